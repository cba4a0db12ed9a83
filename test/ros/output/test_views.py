# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Path, keypoints and debug image: for who subscribes, without a trace in the odometry."""

import dataclasses

import cv2
import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import Image, PointCloud2, PointField

from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.ros.output.debug_image import draw_matches
from aick_ros.ros.output.views import Views

OPTICAL = 'camera_rgb_optical_frame'
T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
COUNT = 10


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
        rig.node.destroy_subscription(subscription)
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
def views(ros_domain):
    rclpy.init(args=[])
    node = rclpy.create_node('probe')
    yield Views(node, 'odom')
    node.destroy_node()
    rclpy.shutdown()


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
