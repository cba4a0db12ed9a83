# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""3-point RANSAC on keypoints with a known motion, and what its limits include."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from aick_ros.evaluation.baselines.ransac3 import ThreePointRansac
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3

TRUTH = se3.exp([0.1, -0.05, 0.2, 0.1, -0.2, 0.15])
METHOD = ThreePointRansac('paper-full')


def frame(stamp, positions, descriptors):
    count = len(positions)
    keypoints = KeypointFrame(stamp, np.asarray(positions, np.float32), descriptors,
                              np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
                              np.zeros((count, 2), np.float32))
    return keypoints, cKDTree(keypoints.positions) if count else None


def error_at(points, estimate):
    """Return the mean distance of points from where they truly are [m]."""
    return np.linalg.norm(se3.transform(estimate.T_target_source, points)
                          - se3.transform(TRUTH, points), axis=1).mean()


def pair(count=60, outliers=0, seed=1, noise=0.0):
    """Return a source and a target; the first points of the target are elsewhere."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 3)) + [0, 0, 2]
    descriptors = rng.integers(0, 256, (count, 32), np.uint8)
    seen = se3.transform(TRUTH, points) + noise * rng.standard_normal((count, 3))
    seen[:outliers] = rng.uniform(-1, 1, (outliers, 3)) + [0, 0, 2]
    return frame(2, points, descriptors), frame(1, seen[::-1], descriptors[::-1].copy())


@pytest.mark.parametrize('outliers', [0, 20, 35])
def test_the_motion_is_that_of_the_source_in_the_target(outliers):
    estimate = METHOD.register(*pair(outliers=outliers))
    np.testing.assert_allclose(estimate.T_target_source, TRUTH, atol=1e-5)
    assert estimate.failure == ''


def test_it_is_refitted_to_all_inliers():
    """With errors of 2 mm three points err by more than sixty of them."""
    errors = []
    for seed in range(5):
        source, target = pair(noise=0.002, seed=seed)
        errors.append(error_at(source[0].positions, METHOD.register(source, target)))
    assert np.mean(errors) < 1.2 * 0.002 * np.sqrt(6 / 60)  # six numbers of sixty points


def test_unlike_descriptors_do_not_match_and_those_at_the_limit_do():
    """52 of 256 bits are .203; 51 are .199."""
    source, target = pair(3)
    flipped = target[0].descriptors.copy()
    flipped[:, :6] ^= 255
    flipped[:, 6] ^= 0b111
    as_seen = dataclasses.replace(target[0], descriptors=flipped), target[1]
    assert METHOD.register(source, as_seen).T_target_source is not None
    flipped[0, 6] ^= 0b1000
    estimate = METHOD.register(source, as_seen)
    assert (estimate.T_target_source, estimate.failure) == (None, 'too few matches')


@pytest.mark.parametrize('counts', [(0, 60), (60, 0), (0, 0), (2, 60)])
def test_fewer_than_three_matches_are_too_few(counts):
    source, target = ((lambda keypoints: frame(
        keypoints.stamp, keypoints.positions[:count], keypoints.descriptors[:count]))(each)
        for (each, _), count in zip(pair(), counts))
    estimate = METHOD.register(source, target)
    assert (estimate.T_target_source, estimate.failure) == (None, 'too few matches')


def test_points_on_a_line_span_no_triangle():
    source, target = pair(20)
    line = np.outer(np.arange(20.0), [0.1, 0.0, 0.0]) + [0, 0, 2]
    estimate = METHOD.register(*(frame(each.stamp, line, each.descriptors)
                                 for each, _ in (source, target)))
    assert (estimate.T_target_source, estimate.failure) == (
        None, 'no three matches span a triangle')


def test_inliers_are_near_any_point_of_the_target():
    """Of one half of the keypoints the descriptors have changed: they support it all the same."""
    source, target = pair(60, noise=0.002, seed=3)
    descriptors = target[0].descriptors.copy()
    descriptors[5:] = np.random.default_rng(9).integers(0, 256, (55, 32), np.uint8)
    estimate = METHOD.register(source, (dataclasses.replace(
        target[0], descriptors=descriptors), target[1]))
    assert error_at(source[0].positions, estimate) < 1.5 * 0.002 * np.sqrt(6 / 60)
