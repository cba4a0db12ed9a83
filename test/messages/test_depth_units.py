# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth in metres from and to whole units: exact, and invalid depth is none."""

import numpy as np
import pytest

from aick_ros.messages import depth_units


@pytest.mark.parametrize('units_per_metre', [1000, 5000])
def test_every_unit_is_the_nearest_float_and_comes_back(units_per_metre):
    units = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    metres = depth_units.to_metres(units, units_per_metre)
    nearest = (units.astype(np.float64) / units_per_metre).astype(np.float32)
    assert metres.dtype == np.float32
    assert np.isnan(metres[0, 0])
    assert np.array_equal(metres.ravel()[1:], nearest.ravel()[1:])
    assert np.array_equal(depth_units.to_units(metres, units_per_metre), units)


def test_invalid_depth_becomes_no_unit():
    depth = np.array([[np.nan, 0.0, -1.0, np.inf, 65.5354, 65.536, 70.0, 0.0004, 0.0006]],
                     np.float32)
    assert depth_units.MILLIMETRES == 1000
    units = depth_units.to_units(depth, depth_units.MILLIMETRES)
    assert units.tolist() == [[0, 0, 0, 0, 65535, 0, 0, 0, 1]]


@pytest.mark.parametrize('order', ['<', '>'])
def test_only_positive_finite_depth_is_valid(order):
    depth = np.array([[np.nan, 0.0, -1.0, np.inf, -np.inf, 1e-9, 65.0]], f'{order}f4')
    before = depth.copy()
    valid = depth_units.valid_metres(depth)
    assert valid.dtype == np.float32 and valid.dtype.isnative
    np.testing.assert_array_equal(valid, np.float32([[np.nan] * 5 + [1e-9, 65.0]]))
    np.testing.assert_array_equal(depth, before)
