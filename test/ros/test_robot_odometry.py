# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry of a robot without a node: what a frame, an IMU and a guess have a part in."""

from types import SimpleNamespace

import numpy as np

from aick_ros.frames.depth_distortion import NO_DISTORTION
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import Mount
from aick_ros.registration.status import Status
from aick_ros.ros.input.extrinsics import Extrinsic
from aick_ros.ros.robot_odometry import RobotOdometry
from aick_ros.settings import NodeSettings, Settings

T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
STEP = se3.exp([0.2, -0.1, 0.4, 0.3, 0.2, 0.1])


class Seen:
    """An odometry whose camera is where a test sets it; ``added`` are the samples of an IMU."""

    def __init__(self):
        self.pose, self.status, self.added = np.eye(4), Status.OK, []
        self.misalignment = SimpleNamespace(values=np.zeros(8), description='')
        self.distortion = NO_DISTORTION
        self.gyroscope = SimpleNamespace(complaint='turns', description='a gyroscope')
        self.gravity = SimpleNamespace(complaint='falls', description='an accelerometer')

    def register(self, preparation, *_, **__):
        return OdometryUpdate(preparation.frame.stamp, self.status, '',
                              PoseWithCovariance(self.pose), None)


class Robot:
    """A robot with a camera, and an IMU whose samples are the stamp of the frame."""

    def __init__(self, guess=None):
        self.odometry = RobotOdometry(
            NodeSettings(initial_pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.5)), Settings(),
            SimpleNamespace(camera_in_base=lambda *_: Extrinsic(T_BASE_CAMERA, Mount.FIXED)),
            SimpleNamespace(samples=lambda camera_frame, stamp: stamp, complaint='no IMU'),
            guess, print)
        self.camera = self.odometry._camera = Seen()

    def see(self, stamp):
        return self.odometry.register(SimpleNamespace(
            frame=SimpleNamespace(stamp=stamp), add_imu=self.camera.added.append), 'optical')


def test_a_frame_moves_the_base_by_the_motion_of_the_camera():
    """By the change of axes of a rigid body."""
    robot = Robot()
    robot.see(1)
    robot.camera.pose = STEP
    found = robot.see(2)
    expected = (se3.from_roll_pitch_yaw(0.0, 0.0, 0.5, (1, 2, 3)) @ T_BASE_CAMERA @ STEP
                @ se3.inverse(T_BASE_CAMERA))
    np.testing.assert_allclose(found.T_odom_base, expected, atol=1e-12)
    np.testing.assert_allclose(found.base.pose.matrix, expected, atol=1e-12)
    np.testing.assert_array_equal(found.camera.pose.matrix, STEP)
    np.testing.assert_array_equal(found.T_base_camera, T_BASE_CAMERA)
    assert (found.frame.stamp, found.camera_frame) == (2, 'optical')
    assert robot.camera.added == [1, 2]


def test_a_stamp_that_is_not_newer_leaves_the_base_where_it_is():
    robot = Robot()
    before = robot.see(2).T_odom_base
    robot.camera.pose, robot.camera.status = STEP, Status.BAD_STAMP
    found = robot.see(1)
    assert found.base is None
    np.testing.assert_array_equal(found.T_odom_base, before)


def test_what_is_wrong_is_said_of_the_imu_and_of_the_guess_apart():
    guess = SimpleNamespace(complaint='no guess')
    for robot, concern in ((Robot(), ''), (Robot(guess), 'no guess')):
        assert robot.odometry.complaint == 'no IMU; turns; falls'
        assert robot.odometry.concern == concern
        assert robot.odometry.findings == {
            'misalignment of the camera': 'none', 'distortion of depth images': 'none',
            'gyroscope': 'a gyroscope', 'accelerometer': 'an accelerometer'}
