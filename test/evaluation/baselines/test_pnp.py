# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PnP on keypoints with a known motion, and how large errors in pixels may be."""

import numpy as np
import pytest

from aick_ros.evaluation.baselines.pnp import Pnp
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3

TRUTH = se3.exp([0.1, -0.05, 0.2, 0.1, -0.2, 0.15])
FOCAL_LENGTH = 500.0


def frame(positions, descriptors):
    count = len(positions)
    return KeypointFrame(1, np.asarray(positions, np.float32), descriptors,
                         np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
                         np.zeros((count, 2), np.float32))


def pair(count=60, seed=1):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 3)) + [0, 0, 3]
    descriptors = rng.integers(0, 256, (count, 32), np.uint8)
    return points, se3.transform(TRUTH, points), descriptors


def registered(points, seen, descriptors, focal_lengths=(7.0, FOCAL_LENGTH)):
    return Pnp(3.0).register((frame(points, descriptors), focal_lengths[0]),
                             (frame(seen, descriptors), focal_lengths[1]))


def test_the_motion_is_that_of_the_source_in_the_target():
    estimate = registered(*pair())
    np.testing.assert_allclose(estimate.T_target_source, TRUTH, atol=1e-5)


def test_the_depth_of_the_target_does_not_count():
    points, seen, descriptors = pair()
    scales = np.random.default_rng(2).uniform(0.3, 3.0, (len(seen), 1))
    np.testing.assert_allclose(registered(points, scales * seen, descriptors).T_target_source,
                               TRUTH, atol=1e-5)


@pytest.mark.parametrize('pixels, is_kept', [(2.0, True), (30.0, False)])
def test_the_largest_error_is_in_pixels_of_the_target(pixels, is_kept):
    """Some of the rays err to the right: they move the camera where they are kept."""
    points, seen, descriptors = pair()
    seen[:8, 0] += pixels / FOCAL_LENGTH * seen[:8, 2]
    error = np.abs(se3.difference(registered(points, seen, descriptors).T_target_source, TRUTH))
    assert (error.max() > 2e-4) == is_kept


@pytest.mark.parametrize('count, failure', [(5, 'too few matches'), (6, '')])
def test_six_matches_are_enough(count, failure):
    assert registered(*pair(count, seed=4)).failure == failure


def test_random_points_have_too_few_inliers():
    points, _, descriptors = pair(12)
    seen = np.random.default_rng(5).uniform(-1, 1, (12, 3)) + [0, 0, 1.2]
    estimate = registered(points, seen, descriptors)
    assert (estimate.T_target_source, estimate.failure) == (None, 'too few inliers')
