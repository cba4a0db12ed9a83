# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera in an ellipsoid, whose depth images are taken later than their stamps say."""

import cv2
import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry

DELAY = 0.02  # s
RATE = 30.0
CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
AXES = np.array([1.6, 1.2, 2.0])  # m
PIXELS = np.mgrid[:120, :160][::-1].reshape(2, -1).T.astype(float)
RAYS = np.column_stack([CAMERA.normalize(PIXELS), np.ones(len(PIXELS))])
TEXTURE = cv2.GaussianBlur(
    np.random.default_rng(1).uniform(0, 255, (600, 1200)).astype(np.float32), (0, 0), 2.0)


def pose_at(time):
    """Return a hand that swings, 4x4."""
    swing = np.sin(np.array([5.0, 4.0, 6.0, 5.5, 4.5, 6.5]) * time + np.arange(6))
    return se3.exp(swing * [0.08, 0.06, 0.08, 0.1, 0.12, 0.1])


def seen_at(time):
    """Return depth along the axis and directions from the centre of what the camera sees."""
    pose = pose_at(time)
    origin, directions = pose[:3, 3] / AXES, RAYS @ pose[:3, :3].T / AXES
    a, b = (directions ** 2).sum(axis=1), directions @ origin
    z = (-b + np.sqrt(b ** 2 - a * (origin @ origin - 1.0))) / a
    return z, origin + z[:, None] * directions


def frame_at(index, delay, stamped=0.0):
    """Return a frame whose depth is taken later than its colour, which its stamp shows or not."""
    time = index / RATE
    x, y, z = seen_at(time)[1].T
    column = (np.arctan2(x, z) / np.pi + 1) * 600
    row = (np.arcsin(np.clip(y, -1, 1)) / np.pi + 0.5) * 600
    grey = cv2.remap(TEXTURE, column.reshape(120, 160).astype(np.float32),
                     row.reshape(120, 160).astype(np.float32), cv2.INTER_LINEAR)
    grey = cv2.normalize(grey, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    noise = 1 + 0.001 * np.random.default_rng(index).standard_normal(len(RAYS))
    depth = (seen_at(time + stamped + delay)[0] * noise).reshape(120, 160).astype(np.float32)
    stamp = 1_000_000_000 + round(1e9 * time)
    return RgbdFrame(stamp, grey, depth, CAMERA, stamp + round(1e9 * stamped))


def learned(delay, count, stamped=0.0):
    odometry = Odometry()
    for index in range(count):
        odometry.register_frame(frame_at(index, delay, stamped))
    return odometry


def test_the_delay_of_the_depth_images_is_learned_and_outlives_a_reset():
    odometry = learned(DELAY, 80)
    assert odometry.misalignment.delay == pytest.approx(DELAY, rel=0.4)
    assert odometry.misalignment.colour_readout == odometry.misalignment.depth_readout == 0.0
    odometry.reset()
    assert odometry.misalignment.delay > 0.0


@pytest.mark.parametrize('stamped', [0.0, DELAY])
def test_nothing_is_learned_of_a_camera_whose_delay_is_none_or_in_the_stamps(stamped):
    odometry = learned(0.0, 35, stamped)
    assert not odometry.misalignment.values.any()
