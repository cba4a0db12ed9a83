# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two cameras in one graph: a node for each under its own namespace, with its own frames."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from nav_msgs.msg import Odometry as OdometryMessage
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Empty

from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, from_transform, to_stamp
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
COUNT = 6


@cache
def render(seed):
    source = SyntheticSource(SyntheticOptions(seed=seed, frames=COUNT, camera=CAMERA))
    return [dataclasses.replace(source.frame(i), depth_stamp=None) for i in range(COUNT)]


class Side:
    """One camera with its node and what comes back, in a namespace."""

    def __init__(self, rig, name, seed):
        self.name, self.rig, self.odom = name, rig, []
        self.frames = render(seed)
        self.colour, self.depth, self.info = (
            rig.node.create_publisher(kind, f'/{name}/{topic}', 100) for kind, topic in (
                (Image, 'rgb/image'), (Image, 'depth/image'), (CameraInfo, 'rgb/camera_info')))
        rig.node.create_subscription(OdometryMessage, f'/{name}/odom', self.odom.append, 100)

    def expected(self):
        odometry = Odometry()
        return {frame.stamp: odometry.register_frame(frame).T_odom_camera
                for frame in self.frames}

    def wait_for_node(self):
        self.rig.wait_until(
            lambda: any(self.name in status.name for message in self.rig.diagnostics
                        for status in message.status)
            and all(publisher.get_subscription_count() for publisher in (
                self.colour, self.depth, self.info)), f'the node of {self.name}')

    def send(self, frame):
        optical = f'{self.name}_optical'
        self.colour.publish(self.rig.image_message(frame.stamp, 'rgb8', frame.colour, optical))
        self.depth.publish(self.rig.image_message(frame.stamp, '32FC1', frame.depth, optical))

    def poses(self):
        return {to_stamp(message.header.stamp): from_pose(message.pose.pose)
                for message in self.odom}


@pytest.fixture
def sides(rig, start_node):
    sides = [Side(rig, 'left', 5), Side(rig, 'right', 7)]
    for side in sides:
        start_node(wait=False, remappings=[f'__ns:=/{side.name}'],
                   frame_id=f'{side.name}_optical', odom_frame_id=f'{side.name}_odom')
    for side in sides:
        side.wait_for_node()
        side.info.publish(rig.camera_info_message(side.frames[0].camera))
    return sides


def test_each_answers_its_own_camera_in_its_own_frames(rig, sides):
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    rig.listen_to_tf()
    for frames in zip(*(side.frames for side in sides)):
        for side, frame in zip(sides, frames):
            side.send(frame)
    for side in sides:
        rig.wait_until(lambda: len(side.odom) == COUNT, f'the answers to {side.name}')
        expected = side.expected()
        for stamp, pose in side.poses().items():
            np.testing.assert_allclose(pose, expected[stamp], atol=1e-6)
        assert {(message.header.frame_id, message.child_frame_id) for message in side.odom} == {
            (f'{side.name}_odom', f'{side.name}_optical')}
    rig.wait_until(lambda: len(rig.links) >= 2 * COUNT - 2, 'the transforms of both')
    for side in sides:
        poses = side.poses()
        for link in rig.links:
            if link.child_frame_id == f'{side.name}_optical':
                assert link.header.frame_id == f'{side.name}_odom'
                np.testing.assert_allclose(from_transform(link.transform),
                                           poses[to_stamp(link.header.stamp)], atol=1e-9)
    assert rig.odom == []  # nothing is published outside of the namespaces


def test_a_service_resets_its_own_node_only(rig, sides):
    left, right = sides
    for i in range(4):
        if i == 3:
            rig.call(Empty, '/left/odom_node/reset_odom')
        for side in sides:
            side.send(side.frames[i])
            rig.wait_until(lambda: len(side.odom) == i + 1, f'answer {i} to {side.name}')
    stamp = left.frames[3].stamp
    np.testing.assert_array_equal(left.poses()[stamp], np.eye(4))
    np.testing.assert_allclose(right.poses()[right.frames[3].stamp],
                               right.expected()[right.frames[3].stamp], atol=1e-6)
