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
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Image, PointCloud2

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.ros import conversions
from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.ros.output.views import colour_image, point_cloud
from aick_ros.ros.watcher import Watcher, check_namespace, watching

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
    assert len(lines) == 4 and lines[2].endswith('endless.rrd" opens what was written')
    assert lines[3].endswith('frames were shown')
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


def test_a_limited_view_ends_with_the_node(rig, start_node, view):
    node = start_node()
    limited, log = view('limited.rrd', '--limit', '5')
    rig.wait_until(lambda: 'odom_node is there: /odom is shown' in log.read_text(), log.read_text)
    node.stop()
    assert limited.wait(rig.patience) == 2
    assert 'odom_node has ended: nobody publishes /odom any more' in log.read_text()
    assert log.read_text().endswith('aick: 0 frames were shown\n')


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
def test_the_diagnostics_of_other_robots_are_left(graph, prefix, heard):
    observer = Observer()
    watcher = graph.add(Watcher(observer, f'/{prefix}'))
    names = 'odom_node', 'robot1/odom_node', 'robot10/odom_node', 'a/b/odom_node', 'b/odom_node'
    watcher._take_diagnostics(DiagnosticArray(status=[
        DiagnosticStatus(name=f'{name}: {part}', message=name)
        for name in names for part in ('odometry', 'images')]))
    assert observer.seen == [('add_health', heard, {})]
    assert watcher.hears


class Observer:
    """Keeps each report as the name of the method and its arguments."""

    def __init__(self):
        self.seen = []

    def __getattr__(self, name):
        return lambda *arguments: self.seen.append((name, *arguments))


@pytest.fixture
def watched(graph):
    """Return a watcher whose callbacks the test calls, and what its observer has seen."""
    observer = Observer()
    return graph.add(Watcher(observer, '/robot')), observer.seen


POSE = se3.exp([1.0, -2.0, 0.5, 0.3, -0.2, 1.1])


def odometry(stamp, covariance):
    return conversions.odometry(conversions.pose_with_covariance(stamp, 'odom', POSE, covariance),
                                'base', np.zeros(6), np.eye(6))


def test_every_frame_is_shown_and_of_views_the_newest(watched):
    watcher, _ = watched
    depths = {subscription.topic_name: (subscription.msg_type, subscription.qos_profile.depth)
              for subscription in watcher.subscriptions}
    assert depths['/robot/odom'][0] is Odometry and depths['/robot/odom'][1] >= 100
    assert depths['/diagnostics'][0] is DiagnosticArray
    assert {topic: depths[f'/robot/{topic}'] for topic in ('debug_image', 'keypoints', 'path')
            } == {'debug_image': (Image, 1), 'keypoints': (PointCloud2, 1), 'path': (Path, 1)}
    assert (watcher.topic, watcher.get_name()) == ('/robot/odom', 'aick_view')
    assert (watcher.frames, watcher.hears) == (0, False)


def test_a_pose_is_shown_with_its_covariance_which_is_infinite_where_it_was_lost(watched):
    watcher, seen = watched
    covariance = np.diag([1, 2, 3, 4, 5, 6]) + 0.1
    watcher._take_odom(odometry(5_000_000_007, covariance))
    watcher._take_odom(odometry(6, conversions.UNKNOWN))
    (name, stamp, pose, shown), (_, other_stamp, _, unknown) = seen
    assert (name, stamp, other_stamp) == ('add_pose', 5_000_000_007, 6)
    np.testing.assert_allclose(pose, POSE, atol=1e-12)
    np.testing.assert_array_equal(shown, covariance)
    np.testing.assert_array_equal(unknown, np.full((6, 6), np.inf))
    assert watcher.frames == 2


def test_a_frame_without_a_pose_is_lost(watched):
    watcher, seen = watched
    watcher._take_odom(Odometry(header=conversions.header(7, 'odom'),
                                pose=conversions.null_pose(7, 'odom').pose))
    assert (seen, watcher.frames) == ([('add_lost', 7)], 1)


def test_the_path_is_taken_once_and_no_longer_subscribed_to(watched):
    watcher, seen = watched
    path = Path(poses=[PoseStamped(pose=conversions.pose(se3.exp([i, 2, 3, 0, 0, 0])))
                       for i in range(2)])
    watcher._take_path(path)
    watcher._take_path(path)
    [(name, positions)] = seen
    assert name == 'add_path'
    np.testing.assert_array_equal(positions, [[0, 2, 3], [1, 2, 3]])
    assert '/robot/path' not in [each.topic_name for each in watcher.subscriptions]


def test_a_path_without_poses_has_the_shape_of_one(watched):
    watcher, seen = watched
    watcher._take_path(Path())
    assert seen[0][1].shape == (0, 3)


def test_pictures_and_keypoints_are_shown_with_their_stamps(watched):
    watcher, seen = watched
    colour = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    points = np.array([[1.0, 2.0, 3.0]])
    watcher._take_image(colour_image(conversions.header(8, 'camera'), colour))
    watcher._take_image(Image(encoding='of another program'))
    watcher._take_keypoints(point_cloud(conversions.header(9, 'odom'), points))
    watcher._take_keypoints(PointCloud2(point_step=16, data=bytes(48)))
    (name, stamp, shown), (other_name, other_stamp, positions) = seen
    assert (name, stamp, other_name, other_stamp) == ('add_image', 8, 'add_keypoints', 9)
    np.testing.assert_array_equal(shown, colour)
    np.testing.assert_array_equal(positions, points)


def test_of_the_diagnostics_the_numbers_are_shown(watched):
    watcher, seen = watched
    values = {'rate': '30.1', 'frames': '7', 'below': '-2.', 'status': 'good: 7 matches',
              'delay': 'unknown', 'nothing': '', 'more': '1e5'}
    watcher._take_diagnostics(DiagnosticArray(status=[DiagnosticStatus(
        name='robot/odom_node: odometry', message='the message',
        values=[KeyValue(key=key, value=value) for key, value in values.items()])]))
    assert seen == [('add_health', 'the message', {'rate': 30.1, 'frames': 7.0, 'below': -2.0})]
    assert watcher.hears


@pytest.mark.parametrize('name', ['robot/odom_node', 'robot/odom_node: images', 'odom_node: odo',
                                  'robot/visual odometry', 'odom_node: odometry'])
def test_diagnostics_of_others_are_not_shown(watched, name):
    watcher, seen = watched
    watcher._take_diagnostics(DiagnosticArray(status=[DiagnosticStatus(name=name)]))
    assert (seen, watcher.hears) == ([], False)


@pytest.mark.parametrize('namespace', ['', 'robot', '/robot', '/a/b_1'])
def test_a_valid_namespace_is_accepted(namespace):
    check_namespace(namespace)


@pytest.mark.parametrize('namespace, reason', [
    ('r\xf6bot', 'letters, digits, _ and / are required'), ('a b', ''), ('1a', ''), ('a//b', '')])
def test_another_namespace_is_rejected_in_one_line(namespace, reason):
    with pytest.raises(InputError) as caught:
        check_namespace(namespace)
    assert str(caught.value).startswith(f'--namespace {namespace}: {reason}')
    assert '\n' not in str(caught.value)


def test_keypoints_of_no_whole_points_are_ignored(watched):
    watcher, seen = watched
    for size in (5, 13, 24):
        watcher._take_keypoints(PointCloud2(point_step=12, data=bytes(size)))
    [(name, _, positions)] = seen
    assert (name, positions.shape) == ('add_keypoints', (2, 3))


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
