# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pairs that the full search lists, against all pairs."""

import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.geometry.point_fit import homogeneous


def near(moved, target, radius):
    return np.frombuffer(kernels.pairs_of_near_points(moved, target, radius),
                         np.int64).reshape(2, -1)


@pytest.mark.parametrize('counts', [(50, 60), (40, 16), (3, 1), (1, 33)], ids=str)
@pytest.mark.parametrize('radius', [0.3, 1.5, 100.0])
def test_pairs_within_a_radius_are_listed_in_order(counts, radius):
    rng = np.random.default_rng(1)
    moved, target = (homogeneous(rng.standard_normal((count, 3)).astype(np.float32))
                     for count in counts)
    distances = np.linalg.norm(moved[:, None] - target[None], axis=2)
    np.testing.assert_array_equal(near(moved, target, radius), np.nonzero(distances < radius))


@pytest.mark.parametrize('counts', [(0, 4), (4, 0), (0, 0)], ids=str)
def test_no_points_are_no_pairs(counts):
    assert near(*(np.zeros((count, 4), np.float32) for count in counts), 1.0).shape == (2, 0)


def test_a_point_that_is_not_finite_is_near_nothing():
    moved = np.float32([[np.nan, 0, 2, 1], [np.inf, 0, 2, 1], [0, 0, 2, 1]])
    assert near(moved, moved, 1.0).tolist() == [[2], [2]]


@pytest.mark.parametrize('points, error', [
    (np.zeros((2, 3), np.float32), ValueError), (np.zeros((4, 4), np.float32)[:, ::2], ValueError),
    (3, TypeError), ([['a'] * 4], TypeError)], ids=['three columns', 'strided', 'number', 'text'])
def test_points_of_another_type_or_shape_are_rejected(points, error):
    good = np.zeros((2, 4), np.float32)
    for pair in ((points, good), (good, points)):
        with pytest.raises(error):
            kernels.pairs_of_near_points(*pair, 1.0)
