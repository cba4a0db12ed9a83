# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Path, keypoints and debug image: for who subscribes, without a trace in the odometry."""

import dataclasses
import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Header

from aick_ros.geometry import se3
from aick_ros.messages.raw_image import decode_colour
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.ros.output import views as views_module
from aick_ros.ros.output.debug_image import draw_matches
from aick_ros.ros.output.views import Views, colour_image, point_cloud, positions_of

OPTICAL = 'camera_rgb_optical_frame'
T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
COUNT = 10
KINDS = {'path': Path, 'keypoints': PointCloud2, 'debug_image': Image}


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:COUNT])


@pytest.fixture(scope='module')
def updates(frames):
    odometry = Odometry()
    return [odometry.register_frame(frame) for frame in frames]


def test_views_are_published_to_subscribers_and_change_nothing(rig, start_node, frames, updates):
    start_node(frame_id='base_link', camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:3]:
        rig.send(frame)
    rig.answer(frames[2].stamp)
    paths, clouds, pictures = [], [], []
    looking = [rig.node.create_subscription(kind, topic, taken.append, 10) for kind, topic, taken
               in ((Path, 'path', paths), (PointCloud2, 'keypoints', clouds),
                   (Image, 'debug_image', pictures))]
    rig.wait_until(lambda: all(rig.node.count_publishers(subscription.topic_name)
                               for subscription in looking), 'the views to be offered')
    for frame in frames[3:]:  # discovery takes its time: some of these are seen
        rig.send(frame)
        rig.answer(frame.stamp)
    again = [dataclasses.replace(frame, stamp=frames[-1].stamp + i * 33_333_333,
                                 depth_stamp=None)
             for i, frame in enumerate(reversed(frames[:-1]), 1)]
    for frame in again:
        rig.send(frame)
        rig.answer(frame.stamp)
    rig.wait_until(lambda: paths and clouds and pictures, 'the views')
    for subscription in looking:
        rig.withdraw(subscription)
    odometry = Odometry()
    expected = {frame.stamp: odometry.register_frame(frame) for frame in [*frames, *again]}
    poses = {stamp: T_BASE_CAMERA @ update.T_odom_camera @ se3.inverse(T_BASE_CAMERA)
             for stamp, update in expected.items()}
    for answer in rig.odom:
        np.testing.assert_allclose(from_pose(answer.pose.pose),
                                   poses[to_stamp(answer.header.stamp)], atol=1e-6)
    check_path(paths[-1], poses)
    check_cloud(clouds[-1], expected, poses)
    assert pictures[-1].header.frame_id == OPTICAL
    assert (pictures[-1].width, pictures[-1].height, pictures[-1].encoding) == (320, 240, 'rgb8')
    assert len(pictures[-1].data) == 320 * 240 * 3


def check_path(path, poses):
    """A late subscriber gets the path from its start."""
    stamps = [to_stamp(pose.header.stamp) for pose in path.poses]
    assert stamps == [stamp for stamp in poses if stamp <= stamps[-1]]
    for stamp, pose in zip(stamps, path.poses):
        assert pose.header.frame_id == 'odom'
        np.testing.assert_allclose(from_pose(pose.pose), poses[stamp], atol=1e-6)


def check_cloud(cloud, expected, poses):
    """The keypoints lie in the odometry's frame."""
    assert cloud.header.frame_id == 'odom'
    stamp = to_stamp(cloud.header.stamp)
    positions = expected[stamp].keypoints.positions
    assert {field.datatype for field in cloud.fields} == {PointField.FLOAT32}
    points = np.frombuffer(cloud.data, np.dtype({
        'names': [field.name for field in cloud.fields], 'formats': ['<f4'] * len(cloud.fields),
        'offsets': [field.offset for field in cloud.fields], 'itemsize': cloud.point_step}))
    assert len(points) == cloud.width * cloud.height
    np.testing.assert_allclose(
        np.stack([points[axis] for axis in 'xyz'], axis=1),
        se3.transform(poses[stamp] @ T_BASE_CAMERA, positions), atol=1e-5)


@pytest.fixture
def node(graph):
    return graph.node()


@pytest.fixture
def views(node):
    return Views(node, 'odom')


class Subscribers:
    """Subscribers of the views of a node, which have found its publishers."""

    def __init__(self, graph):
        self._graph = graph
        self.received = {topic: graph.listen(kind, topic) for topic, kind in KINDS.items()}

    def newest(self, topic, stamp):
        """Wait for the message of a topic with a stamp [ns], and return it."""
        messages = self.received[topic]
        self._graph.wait_until(
            lambda: messages and to_stamp(messages[-1].header.stamp) == stamp, topic)
        return messages[-1]


def test_nothing_is_drawn_without_a_subscriber(views, frames, updates, monkeypatch):
    def refuse(*arguments):
        raise AssertionError('drawn for nobody')
    monkeypatch.setattr('aick_ros.ros.output.views.draw_matches', refuse)
    monkeypatch.setattr('aick_ros.ros.output.views.point_cloud', refuse)
    views.show(frames[1], updates[1], np.eye(4), np.eye(4), OPTICAL)


def test_a_long_path_is_thinned_and_keeps_its_ends(views):
    for i in range(10_000):
        pose = PoseStamped()
        pose.pose.position.x = float(i)
        views._lengthen(pose)
    x = [pose.pose.position.x for pose in views._poses]
    assert len(x) <= 1000
    assert (x[0], x[-1]) == (0.0, 9999.0)
    assert x == sorted(x)


def test_a_long_path_is_not_published_with_each_frame(views, monkeypatch):
    """Of a hundred poses and more it would take a share of the time of each frame."""
    steady, published = SimpleNamespace(now=100.0), []
    monkeypatch.setattr(views_module.time, 'monotonic', lambda: steady.now)
    monkeypatch.setattr(views, '_path', SimpleNamespace(
        get_subscription_count=lambda: 1,
        publish=lambda path: published.append((steady.now, len(path.poses)))))
    update = SimpleNamespace(stamp=0, status=Status.OK)
    for _ in range(300):
        steady.now += 0.01
        views.show(None, update, np.eye(4), np.eye(4), 'camera')
    times, lengths = np.transpose(published)
    np.testing.assert_array_equal(lengths[:100], np.arange(1, 101))
    waited = np.diff(times)[99:] / lengths[99:-1]
    assert len(waited) > 10 and (waited > 0.00049).all() and (waited < 0.00061).all()


T_ODOM_BASE = se3.exp([1.0, -2.0, 0.5, 0.3, -0.2, 1.1])


def show(views, frame, update):
    views.show(frame, update, T_ODOM_BASE, T_BASE_CAMERA, OPTICAL)


def test_only_the_newest_of_each_view_waits_for_a_slow_subscriber(node, views):
    offered = {publisher.topic_name: (publisher.msg_type, publisher.qos_profile.depth)
               for publisher in node.publishers}
    assert {topic: offered[f'/{topic}'] for topic in KINDS} == {
        topic: (kind, 1) for topic, kind in KINDS.items()}


def test_each_view_has_the_stamp_of_the_frame_and_its_own_frame_id(
        graph, node, frames, updates):
    views = Views(node, 'start')
    subscribers = Subscribers(graph)
    for i in (1, 2):
        show(views, frames[i], updates[i])
        path, cloud, picture = (subscribers.newest(topic, updates[i].stamp)
                                for topic in ('path', 'keypoints', 'debug_image'))
        assert [view.header.frame_id for view in (path, cloud, picture)] == [
            'start', 'start', OPTICAL]
        assert [to_stamp(pose.header.stamp) for pose in path.poses] == [
            update.stamp for update in updates[1:i + 1]]
        assert path.poses[-1].header.frame_id == 'start'
        np.testing.assert_allclose(from_pose(path.poses[-1].pose), T_ODOM_BASE, atol=1e-9)
        np.testing.assert_allclose(positions_of(cloud), se3.transform(
            T_ODOM_BASE @ T_BASE_CAMERA, updates[i].keypoints.positions), atol=1e-5)
        np.testing.assert_array_equal(
            np.reshape(picture.data, (240, 320, 3)), draw_matches(frames[i].colour, updates[i]))


def test_a_lost_frame_is_drawn_but_neither_on_the_path_nor_in_the_cloud(
        graph, views, frames, updates):
    subscribers = Subscribers(graph)
    show(views, frames[1], dataclasses.replace(updates[1], status=Status.TOO_FEW_MATCHES))
    subscribers.newest('debug_image', updates[1].stamp)
    show(views, frames[2], updates[2])
    assert len(subscribers.newest('path', updates[2].stamp).poses) == 1
    subscribers.newest('keypoints', updates[2].stamp)
    assert [len(subscribers.received[topic]) for topic in ('path', 'keypoints')] == [1, 1]


def test_a_path_grows_while_nobody_looks_and_begins_anew_after_a_reset(
        graph, views, frames, updates, monkeypatch):
    sent = []
    with monkeypatch.context() as patched:
        patched.setattr(views._path, 'publish', sent.append)
        show(views, frames[1], updates[1])
    assert sent == []
    subscribers = Subscribers(graph)
    show(views, frames[2], updates[2])
    assert len(subscribers.newest('path', updates[2].stamp).poses) == 2
    views.reset()
    show(views, frames[3], updates[3])
    assert [to_stamp(pose.header.stamp)
            for pose in subscribers.newest('path', updates[3].stamp).poses] == [updates[3].stamp]


def test_a_path_has_at_most_a_thousand_poses(views):
    sizes = []
    for i in range(1002):
        views._lengthen(PoseStamped())
        sizes.append(len(views._poses))
    assert sizes[998:] == [999, 1000, 501, 502]


def test_a_cloud_is_made_of_three_numbers_a_point():
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 6.25]])
    cloud = point_cloud(Header(frame_id='odom'), points)
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 2, 12, 24)
    assert (cloud.is_bigendian, cloud.is_dense) == (False, True)
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        ('x', 0, PointField.FLOAT32, 1), ('y', 4, PointField.FLOAT32, 1),
        ('z', 8, PointField.FLOAT32, 1)]
    assert struct.unpack('<6f', bytes(cloud.data)) == (1.0, 2.0, 3.0, -4.0, 0.5, 6.25)
    np.testing.assert_array_equal(positions_of(cloud), points)
    assert positions_of(point_cloud(Header(), np.zeros((0, 3)))).shape == (0, 3)


def test_an_image_is_sent_as_it_is():
    colour = np.arange(2 * 5 * 3, dtype=np.uint8).reshape(2, 5, 3)
    message = colour_image(Header(frame_id='camera'), colour)
    assert (message.height, message.width, message.step, message.encoding) == (2, 5, 15, 'rgb8')
    assert message.header.frame_id == 'camera'
    assert not message.is_bigendian
    np.testing.assert_array_equal(decode_colour(message), colour)


def test_lines_run_from_where_a_keypoint_was_to_where_it_is(frames, updates):
    """In the difference to the image; far from all of them the image is as it was."""
    update = updates[1]
    picture = draw_matches(frames[1].colour, update)
    changed = (picture.astype(int) - frames[1].colour).any(axis=2)
    ways = np.zeros(changed.shape, np.uint8)
    for source, target in update.matches:
        for pixel in (update.keypoints.pixels[source], update.reference.pixels[target]):
            u, v = np.rint(pixel).astype(int)
            assert changed[max(v - 3, 0):v + 4, max(u - 3, 0):u + 4].any()
        cv2.line(ways, *(np.rint(pixel).astype(int).tolist() for pixel in (
            update.keypoints.pixels[source], update.reference.pixels[target])), 1, 9)
    for pixel in update.keypoints.pixels:
        cv2.circle(ways, np.rint(pixel).astype(int).tolist(), 5, 1, -1)
    assert not changed[:-20][ways[:-20] == 0].any()


def test_a_lost_frame_is_marked_in_red(frames, updates):
    grey = np.full((240, 320), 90, np.uint8)
    lost = dataclasses.replace(updates[0], status=Status.TOO_FEW_MATCHES, reason='3 matches')
    picture = draw_matches(grey, lost)
    caption = picture[-16:].astype(int)
    assert (caption[..., 0] > caption[..., 1] + 100).any()
    assert np.all(grey == 90)
