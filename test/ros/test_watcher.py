# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick view --live`` beside the real node; its file is read back by Rerun's own reader."""

import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import PointCloud2

from aick_ros.errors import InputError
from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.ros.watcher import Watcher, watching

rerun = pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')
FRAMES = 6


@pytest.fixture
def view(rig, tmp_path):
    """Return a function that starts the command with a file to write."""
    started = []

    def start(name, *arguments):
        log = tmp_path / f'{name}.log'
        with log.open('w') as stream:
            process = subprocess.Popen(
                [sys.executable, '-m', 'aick_ros', 'view', '--live', '--save', tmp_path / name,
                 *arguments], stderr=stream)
        started.append(process)
        return process, log
    yield start
    for process in started:
        process.kill()
        process.wait()


def read(path):
    """Return entity and component -> its times [s] and values."""
    from rerun.chunk import RrdReader
    found = {}
    for chunk in RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = dict(zip(batch.schema.names, batch.columns))
        times = columns.get('time')
        seconds = [None] * batch.num_rows if times is None else (
            np.array(times.to_pylist(), 'timedelta64[ns]') / np.timedelta64(1, 's')).tolist()
        for name, column in columns.items():
            found.setdefault(f'{chunk.entity_path}/{name}', []).extend(
                zip(seconds, column.to_pylist()))
    return found


def test_a_running_node_is_shown_until_ctrl_c(rig, start_node, view, all_frames, darken, tmp_path):
    start_node(lost_policy='null')
    limited, log = view('limited.rrd', '--limit', str(FRAMES + 1))
    endless, other_log = view('endless.rrd')
    for text in (log, other_log):
        rig.wait_until(lambda: 'odom_node is there: /odom is shown' in text.read_text(),
                       text.read_text)
    rig.send_camera_info(all_frames[0].camera)
    shown = [*all_frames[:FRAMES - 1], darken(all_frames[FRAMES - 1]), all_frames[FRAMES]]
    for frame in shown:
        rig.send(frame)
        rig.answer(frame.stamp)
    assert limited.wait(rig.patience) == 0
    assert f'{FRAMES + 1} frames were shown' in log.read_text()
    endless.send_signal(signal.SIGINT)
    assert endless.wait(rig.patience) == 0
    lines = other_log.read_text().splitlines()
    assert len(lines) == 3 and lines[2].endswith('frames were shown')
    assert '/world/base/Transform3D:translation' in read(tmp_path / 'endless.rrd')

    found = read(tmp_path / 'limited.rrd')
    lost = shown[FRAMES - 1].stamp
    sent = [message for message in rig.odom if to_stamp(message.header.stamp) != lost]
    seconds, positions = zip(*found['/world/base/Transform3D:translation'])
    np.testing.assert_allclose(seconds, [
        (to_stamp(message.header.stamp) - shown[0].stamp) / 1e9 for message in sent], atol=1e-6)
    np.testing.assert_allclose(np.concatenate(positions), [
        from_pose(message.pose.pose)[:3, 3] for message in sent], atol=1e-6)
    assert [tracked for _, [tracked] in found['/status/tracked/Scalars:scalars']] == [
        1.0] * (FRAMES - 1) + [0.0, 0.0]  # the first pose after a loss has no covariance
    assert found['/image/EncodedImage:blob']
    for seconds, blob in found['/image/EncodedImage:blob']:
        frame = min(shown, key=lambda frame: abs(
            frame.stamp - shown[0].stamp - 1e9 * seconds))
        image = cv2.imdecode(np.array(blob, np.uint8).ravel(), cv2.IMREAD_COLOR)[:, :, ::-1]
        difference = np.abs(image.astype(int) - frame.colour)
        assert np.median(difference) < 8  # of JPEG, but for keypoints and lines
    assert {'/world/path_before/LineStrips3D:strips', '/world/keypoints/Points3D:positions',
            '/world/covariance/Ellipsoids3D:half_sizes'} <= found.keys()


def test_remapped_topics_are_watched(ros_domain):
    heard = []
    observer = SimpleNamespace(add_health=lambda message, numbers: heard.append(message))
    rules = ['odom:=camera/odom', '/diagnostics:=health']
    with watching(observer, 'robot', rules) as (watcher, _):
        assert watcher.topic == '/robot/camera/odom'
        assert watcher.resolve_topic_name('path') == '/robot/path'
        publisher = watcher.create_publisher(DiagnosticArray, '/robot/health', 10)
        end = time.monotonic() + 30
        while not heard and time.monotonic() < end:
            publisher.publish(DiagnosticArray(status=[DiagnosticStatus(
                name='robot/odom_node: odometry', message='good')]))
            time.sleep(0.01)
    assert heard


@pytest.mark.parametrize('rule', ['odom', ':=x', 'odom:=a b', ''])
def test_a_rule_that_is_none_is_rejected(ros_domain, rule):
    with pytest.raises(InputError, match='^ROS rejects these arguments: '):
        with watching(SimpleNamespace(), '', [rule]):
            pass


@pytest.mark.parametrize('prefix, heard', [
    ('', 'odom_node'), ('robot1', 'robot1/odom_node'), ('a/b', 'a/b/odom_node')])
def test_the_diagnostics_of_other_robots_are_left(prefix, heard):
    shown = []
    watcher = SimpleNamespace(_prefix=prefix, hears=False, _observer=SimpleNamespace(
        add_health=lambda message, numbers: shown.append(message)))
    names = 'odom_node', 'robot1/odom_node', 'robot10/odom_node', 'a/b/odom_node', 'b/odom_node'
    Watcher._take_diagnostics(watcher, DiagnosticArray(status=[
        DiagnosticStatus(name=f'{name}: {part}', message=name)
        for name in names for part in ('odometry', 'images')]))
    assert shown == [heard]
    assert watcher.hears


def test_keypoints_of_no_whole_points_are_ignored():
    shown = []
    watcher = SimpleNamespace(_observer=SimpleNamespace(
        add_keypoints=lambda stamp, positions: shown.append(positions.shape)))
    for size in (5, 13, 24):
        Watcher._take_keypoints(watcher, PointCloud2(point_step=12, data=bytes(size)))
    assert shown == [(2, 3)]


def test_an_error_of_the_observer_ends_the_watching(ros_domain):
    def fail(message, numbers):
        raise InputError('the viewer ended')
    status = DiagnosticStatus(name='odom_node: odometry')
    with pytest.raises(InputError, match='the viewer ended'):
        with watching(SimpleNamespace(add_health=fail), '') as (watcher, spin):
            publisher = watcher.create_publisher(DiagnosticArray, '/diagnostics', 10)
            end = time.monotonic() + 30
            while not spin.done() and time.monotonic() < end:
                publisher.publish(DiagnosticArray(status=[status]))
                time.sleep(0.01)
