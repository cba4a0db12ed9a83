# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is shown of a frame: small images, and the pose of the odometry, which may turn."""

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.odometry.inertial.level import Turn
from aick_ros.reports.shown_frame import ShownFrame, _depth

CAMERA = Camera(64, 48, 60.0, 60.0, 32.0, 24.0)


def test_depth_is_in_millimetres_and_nothing_is_zero():
    depth = np.full((9, 10), 5.0, np.float32)
    depth[0, 0], depth[0, 4], depth[4, 0], depth[4, 4] = 1.2345, np.nan, np.inf, 70.0
    frame = RgbdFrame(1, np.zeros((9, 10), np.uint8), depth, Camera(10, 9, 9.0, 9.0, 5.0, 4.0))
    np.testing.assert_array_equal(_depth(frame), [[1234, 0], [0, 65535]])


def test_what_is_shown_turns_with_the_odometry_and_keeps_no_image_of_it():
    update = Odometry().register_frame(RgbdFrame(
        7, np.zeros((48, 64, 3), np.uint8), np.full((48, 64), 1.5, np.float32), CAMERA))
    shown = ShownFrame.of(update)
    turn = Turn(se3.exp([0.0, 0.0, 0.0, 0.1, 0.2, 0.0]), np.zeros(3), *2 * [1e-4 * np.eye(2)])
    turned = shown.turned(turn)
    assert turned.stamp == shown.stamp == 7
    np.testing.assert_array_equal(turned.record.T_odom_camera, update.turned(turn).T_odom_camera)
    assert turned.keypoints is update.keypoints and turned.jpeg is shown.jpeg
    kept = sum(len(part) if isinstance(part, bytes) else part.nbytes for part in (
        shown.jpeg, shown.depth))
    assert kept < update.prepared.frame.depth.nbytes / 2
