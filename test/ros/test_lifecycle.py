# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node's process: started in any order, ended at any time, not stopped by one bad frame."""

import dataclasses
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose
from aick_ros.ros.playback.node_process import NODE_COMMAND

COUNT = 12
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine
ENDINGS = [signal.SIGINT, signal.SIGTERM]

# A defect of ours: the registration of one frame fails.
DEFECTIVE = '''
from aick_ros.registration.aick import aick
from aick_ros.ros import odom_node
align = aick.Aick.align
def fail_once(self, source, target):
    if source.stamp == {stamp}:
        raise ZeroDivisionError('a defect')
    return align(self, source, target)
aick.Aick.align = fail_once
odom_node.main()
'''


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:COUNT])


def send_all(rig, frames):
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)


def test_a_defect_in_one_frame_is_logged_counted_and_does_not_stop_the_next(
        rig, start_node, frames):
    node = start_node(command=(
        sys.executable, '-c', DEFECTIVE.format(stamp=frames[3].stamp)))
    send_all(rig, frames[:8])
    odometry = Odometry()
    for i, frame in enumerate(frames[:8]):
        if i == 3:
            continue
        expected = odometry.register_frame(frame).T_odom_camera
        found = from_pose(rig.answer(frame.stamp).pose.pose)
        if i > 3:
            np.testing.assert_allclose(se3.inverse(expected) @ found, np.eye(4), atol=0.01)
    assert frames[3].stamp not in rig.stamps()
    assert f'frame {frames[3].stamp} ns failed, please report this' in node.log
    assert node.log.count('ZeroDivisionError: a defect') == 1
    rig.wait_until(lambda: rig.diagnostics[-1].status[0].level == b'\x02', 'the level ERROR')
    assert 'see the log and report it' in rig.diagnostics[-1].status[0].message
    assert node.stop() == 0


def test_a_camera_that_runs_already_is_answered_from_the_first_frames_on(
        rig, start_node, frames):
    """The node comes last: nothing but the camera's next messages is needed."""
    start_node(wait=False)
    sent, deadline = 0, time.monotonic() + PATIENCE
    while not rig.odom:
        assert time.monotonic() < deadline
        frame = frames[sent % 2]
        rig.send_camera_info(frame.camera)
        rig.send(dataclasses.replace(frame, stamp=frames[0].stamp + sent * 33_333_333,
                                     depth_stamp=None))
        sent += 1
        time.sleep(0.03)


@pytest.mark.parametrize('how', ENDINGS)
def test_ends_cleanly_without_a_camera(rig, start_node, how):
    node = start_node(command=NODE_COMMAND)
    assert node.stop(how) == 0
    # a slow machine may take longer than the camera's silence is tolerated
    assert [line for line in node.log.splitlines() if 'rig is there' not in line] == []


@pytest.mark.parametrize('how', ENDINGS)
def test_ends_cleanly(rig, start_node, frames, how):
    node = start_node(command=NODE_COMMAND)
    send_all(rig, frames[:3])
    rig.answer(frames[2].stamp)
    assert node.stop(how) == 0
    assert 'Traceback' not in node.log


@pytest.mark.parametrize('how', ENDINGS)
def test_ends_cleanly_in_the_middle_of_work(rig, start_node, frames, how):
    node = start_node(command=NODE_COMMAND, preset='paper-full')
    send_all(rig, frames)
    rig.answer(frames[1].stamp)
    assert node.stop(how) == 0
    assert 'Traceback' not in node.log


@pytest.mark.parametrize('how', ENDINGS)
def test_ends_cleanly_while_it_starts(ros_domain, how):
    """From the moment its own code runs: importing, initialising, subscribing."""
    for delay in (0.02, 0.1, 0.15, 0.2, 0.25, 0.3):
        assert ending(delay, [how]) == (0, ''), f'after {delay} s'


@pytest.mark.parametrize('gap', [0.0, 0.002, 0.005, 0.01, 0.02])
def test_two_signals_end_it_as_cleanly_as_one(ros_domain, gap):
    """As where a terminal and launch, or systemd, signal the whole group; the worker is busy."""
    for delay in (0.7, 1.0, 1.3):
        assert ending(delay, [signal.SIGINT, signal.SIGINT], gap) == (0, ''), f'after {delay} s'


@pytest.mark.parametrize('program', ['odom_node', 'odom_lifecycle_node', 'bag_player'])
def test_signals_of_both_kinds_while_it_starts_end_it_cleanly(ros_domain, program):
    """They come while it imports; the second must not interrupt the handling of the first."""
    arguments = ['no_bag'] if program == 'bag_player' else []  # it ends before it reads that
    assert ending(0.02, ENDINGS, 0.0, program, *arguments) == (0, '')


def ending(delay, signals, gap=0.0, program='odom_node', *arguments):
    """
    Start a program, signal it after some time [s]; return its exit code and complaints.

    The time begins where the program holds signals back, which is the first that it does.
    """
    begin = f"""
from aick_ros.ros.process import entry_points
hold = entry_points.hold
entry_points.hold = lambda: (hold(), print(flush=True))
entry_points.{program}()
"""
    process = subprocess.Popen([sys.executable, '-c', begin, *arguments], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    process.stdout.readline()
    time.sleep(delay)
    for i, how in enumerate(signals):
        time.sleep(gap if i else 0.0)
        process.send_signal(how)
    _, complaints = process.communicate(timeout=PATIENCE)
    return process.returncode, complaints


def test_a_parameter_out_of_range_is_rejected_in_one_line(ros_domain):
    run = subprocess.run(
        [*NODE_COMMAND, '--ros-args', '-p', 'aick.alpha:=1.5'],
        capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert run.stderr.startswith('odom_node: aick.alpha = 1.5 is outside 0 to 1')
    assert run.stderr.count('\n') == 1


def test_an_empty_list_is_rejected_in_one_line(ros_domain):
    run = subprocess.run([*NODE_COMMAND, '--ros-args', '-p', 'camera_in_base:=[]'],
                         capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert run.stderr.startswith('odom_node: a parameter is an empty list or has no value')
    assert run.stderr.count('\n') == 1


def test_arguments_that_ros_rejects_are_one_line(ros_domain, tmp_path):
    file = tmp_path / 'parameters.yaml'
    file.write_text('odom_node: [')
    run = subprocess.run([*NODE_COMMAND, '--ros-args', '--params-file', str(file)],
                         capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert 'odom_node: ROS rejects these arguments' in run.stderr
    assert 'Traceback' not in run.stderr


def test_security_that_ros_does_not_have_is_one_line(ros_domain, tmp_path):
    """The wheels' Fast DDS is built without; elsewhere the enclave is missing."""
    (tmp_path / 'enclaves').mkdir()
    run = subprocess.run(NODE_COMMAND, capture_output=True, text=True, timeout=PATIENCE, env={
        **os.environ, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce',
        'ROS_SECURITY_KEYSTORE': str(tmp_path)})
    assert run.returncode == 2
    assert run.stderr.splitlines()[-1].startswith('odom_node: ROS ')
    assert 'Traceback' not in run.stderr
