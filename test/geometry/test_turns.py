# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The rotation of a body by its turn rates, against the closed form of an even turn."""

import numpy as np
from scipy.spatial.transform import Rotation

from aick_ros.geometry.turns import integrated_turns


def test_rates_about_one_axis_are_added_whatever_the_intervals():
    rng = np.random.default_rng(0)
    stamps = np.cumsum(rng.integers(1, 20_000_000, 50)) + 1_700_000_000_000_000_000
    sizes, axis = rng.uniform(-5, 5, 50), np.array([2.0, -1.0, 2.0]) / 3.0
    first = Rotation.from_rotvec([0.4, -2.0, 1.0]).as_matrix()
    rotations, integrals, products = integrated_turns(
        stamps, sizes[:, None] * axis, first, 7.0 * np.eye(3), np.full((3, 3, 3), 5.0))
    steps = np.diff(stamps) / 1e9 * 0.5 * (sizes[1:] + sizes[:-1])
    angles = np.concatenate([[0.0], np.cumsum(steps)])
    expected = first @ Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
    np.testing.assert_allclose(rotations, expected, atol=1e-12)
    middle = first @ Rotation.from_rotvec((angles[:-1] + 0.5 * steps)[:, None] * axis).as_matrix()
    parts = (np.diff(stamps) / 1e9)[:, None, None] * middle
    np.testing.assert_allclose(integrals[1:], 7.0 * np.eye(3) + np.cumsum(parts, 0), atol=1e-12)
    np.testing.assert_array_equal(integrals[0], 7.0 * np.eye(3))
    angle_parts = steps[:, None, None, None] * middle[..., None] * axis
    np.testing.assert_allclose(products[1:], 5.0 + np.cumsum(angle_parts, 0), atol=1e-12)
    np.testing.assert_array_equal(products[0], 5.0)


def test_one_sample_is_no_motion_and_two_at_once_are_none():
    for stamps in (np.array([5]), np.array([5, 5])):
        rotations, integrals, products = integrated_turns(
            stamps, np.ones((len(stamps), 3)), np.eye(3), np.zeros((3, 3)), np.zeros((3, 3, 3)))
        np.testing.assert_array_equal(rotations[-1], np.eye(3))
        assert not integrals.any() and not products.any()
