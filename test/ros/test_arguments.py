# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arguments outside of --ros-args are understood, or rejected; none is swallowed."""

import re
import subprocess

import pytest

from aick_ros.errors import InputError
from aick_ros.ros.arguments import Arguments, read_arguments
from aick_ros.ros.playback.node_process import NODE_COMMAND


@pytest.mark.parametrize('argv, expected', [
    ([], Arguments()),
    (['--ros-args', '-p', 'frame_id:=body'], Arguments()),
    (['--ros-args', '-p', 'frame_id:=body', '--', '--udebug'], Arguments(level='debug')),
    ([''], Arguments()),  # an empty substitution of launch
    (['--Odom/ResetCountdown', '1'], Arguments({'Odom/ResetCountdown': '1'})),
    (['--Vis/MinInliers 12 --uwarn', '--ros-args', '-r', '__node:=a'],
     Arguments({'Vis/MinInliers': '12'}, 'warn')),
    (['--Vis/MaxDepth', '-1', '--udebug'], Arguments({'Vis/MaxDepth': '-1'}, 'debug')),
    (['-d --Odom/Strategy 1', '--delete_db_on_start', ''],  # as launch files share them with SLAM
     Arguments({'Odom/Strategy': '1'}, of_slam=('-d', '--delete_db_on_start')))])
def test_what_they_mean(argv, expected):
    assert read_arguments(['odom_node', *argv]) == expected


@pytest.mark.parametrize('argv, sentence', [
    (['-p', 'frame_id:=x'], '-p is an argument of ROS: put --ros-args before it'),
    (['frame_id:=x'], 'frame_id:=x is an argument of ROS: put --ros-args before it'),
    (['--params'], 'all parameters are in config/odom_node.yaml'),
    (['--Odom/Strategy'], '--Odom/Strategy has no value'),
    (['--Odom/Strategy', '--udebug'], '--Odom/Strategy has no value'),
    (['--fast'], 'the argument --fast is not known: see --help'),
    (['camera'], 'the argument camera is not known')])
def test_what_means_nothing_is_rejected(argv, sentence):
    with pytest.raises(InputError, match=sentence):
        read_arguments(['odom_node', *argv])


@pytest.mark.parametrize('option', ['-h', '--help'])
def test_help(option, capsys):
    with pytest.raises(SystemExit) as end:
        read_arguments(['odom_node', option])
    assert end.value.code == 0
    assert '--ros-args -p NAME:=VALUE' in capsys.readouterr().out


def test_the_process_ends_with_one_sentence(ros_domain):
    done = subprocess.run([*NODE_COMMAND, '-p', 'frame_id:=x'], capture_output=True, text=True,
                          timeout=120)
    assert done.returncode == 2
    assert done.stderr == 'odom_node: -p is an argument of ROS: put --ros-args before it\n'
    # and where ROS rejects its own, its log has no line beside the sentence
    done = subprocess.run([*NODE_COMMAND, '--ros-args', '-p', 'frame_id:={'],
                          capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert re.fullmatch('odom_node: ROS rejects these arguments: .*frame_id.*\n', done.stderr)
    done = subprocess.run([*NODE_COMMAND, '--help'], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.startswith('usage: odom_node')


def test_the_node_says_what_they_mean(rig, start_node):
    node = start_node('--Odom/ResetCountdown', '1', '-d', '--uinfo', publish_null_when_lost='true')
    node.wait_for_log("parameter 'Odom/ResetCountdown' of rgbd_odometry changes nothing here")
    node.wait_for_log("parameter 'publish_null_when_lost' is read as lost_policy = 'null'")
    node.wait_for_log('argument -d is one of the SLAM node of RTAB-Map and changes nothing here')
