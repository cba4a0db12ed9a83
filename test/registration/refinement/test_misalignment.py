# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a misaligned camera sees, by the exact motion of its two images."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import (
    Displacement, Misalignment, Prediction, rows_of)

CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
HEIGHT = 480 / 525
TWIST = np.array([0.3, -0.2, 0.25, 0.5, -0.8, 0.6])  # a hand that moves fast
OFFSET = np.array([0.02, -0.01, 0.015, 0.02, -0.03, 0.01])


def seen_points(count=200):
    """Return points in the view of the camera at its stamp."""
    rng = np.random.default_rng(1)
    z = rng.uniform(0.6, 3.0, count)
    x, y = rng.uniform(-0.5, 0.5, count), rng.uniform(-0.4, 0.4, count)
    return np.column_stack([x * z, y * z, z])


def at_time(points, times):
    """Return where a camera with the twist sees points at times after its stamp."""
    return np.array([se3.transform(se3.exp(-time * TWIST), point[None])[0]
                     for point, time in zip(points, times)])


@pytest.mark.parametrize('lag', [0.0, 0.01])
@pytest.mark.parametrize('misalignment', [
    Misalignment(OFFSET, 0.0, 0.0), Misalignment(np.zeros(6), -0.02, 0.0),
    Misalignment(np.zeros(6), 0.0, 0.02), Misalignment(OFFSET, 0.015, 0.02)])
def test_points_of_the_depth_image_return_to_the_stamp(misalignment, lag):
    points = seen_points()
    times = np.zeros(len(points))
    for _ in range(5):  # the row in which a point is seen depends on when it is seen
        moved = at_time(points, times)
        in_depth = se3.transform(se3.exp(-misalignment.offset), moved)
        times = lag + misalignment.delay + misalignment.readout * rows_of(in_depth, HEIGHT)
    displacement = Displacement.of(misalignment, lag, TWIST, CAMERA)
    size = np.abs(in_depth - points).max()
    assert size > 0.01
    assert np.abs(displacement.of_depth(in_depth) - points).max() < 0.02 * size
    assert np.abs(displacement.to_depth(points) - in_depth).max() < 0.03 * size


def test_keypoints_return_to_the_stamp_whatever_the_depth_camera_does():
    points = seen_points()
    times = np.zeros(len(points))
    for _ in range(5):
        seen = at_time(points, times)
        times = 0.02 * rows_of(seen, HEIGHT)
    displacement = Displacement.of(Misalignment(OFFSET, -0.02, 0.02), 0.01, TWIST, CAMERA)
    assert np.abs(seen - points).max() > 0.005
    assert np.abs(displacement.of_rows(seen) - points).max() < 2e-4


def test_the_velocity_is_between_the_one_before_and_the_one_measured():
    start = se3.exp(np.array([0.1, 0.2, -0.1, 0.2, -0.1, 0.3]))
    old = TWIST + np.array([0.1, 0.0, -0.2, 0.3, 0.2, -0.1])
    prediction = Prediction(start @ se3.exp(0.04 * old), old, 0.04)
    assert prediction.twist_with(prediction.T_target_source) == pytest.approx(old)
    assert prediction.twist_with(start @ se3.exp(0.04 * TWIST)) == pytest.approx(
        0.25 * old + 0.75 * TWIST)
