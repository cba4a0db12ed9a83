# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Enlarged depth images: exact on planes, no depth between two surfaces."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages.depth_scaling import enlarge


def plane(height, width, factor):
    """Return the depth of a slanted plane at the centres of the blocks, HxW [m]."""
    v, u = (np.mgrid[:height, :width] + 0.5) * factor - 0.5
    return (1.0 / (0.4 + 0.0005 * u - 0.0003 * v)).astype(np.float32)


@pytest.mark.parametrize('factor', [2, 3, 4])
def test_exact_on_a_plane(factor):
    large = enlarge(plane(60, 80, factor), 80 * factor, 60 * factor)
    inner = slice(factor, -factor)
    np.testing.assert_allclose(large[inner, inner],
                               plane(60 * factor, 80 * factor, 1)[inner, inner], rtol=1e-5)


def test_edges_and_holes_are_blocks_of_measured_depth():
    small = np.full((60, 80), 3.0, np.float32)
    small[:, 40:] = 1.0
    small[10, 10] = np.nan
    large = enlarge(small, 160, 120)
    assert large.dtype == np.float32
    np.testing.assert_array_equal(large, np.kron(small, np.ones((2, 2))))


@pytest.mark.parametrize('ratio, is_edge', [(1.03, False), (1.049, False), (1.051, True)])
def test_a_step_of_more_than_5_percent_is_an_edge(ratio, is_edge):
    small = np.ones((6, 8), np.float32)
    small[:, 4:] = ratio
    between = ~np.isin(enlarge(small, 16, 12), np.float32([1.0, ratio]))
    assert between.any() != is_edge


def test_depth_of_the_same_size_is_returned_as_it_is():
    depth = plane(60, 80, 1)
    assert enlarge(depth, 80, 60) is depth


@pytest.mark.parametrize('width, height', [(640, 512), (80, 120), (100, 75), (40, 30), (160, 60)])
def test_other_factors_are_rejected(width, height):
    with pytest.raises(InputError) as raised:
        enlarge(plane(60, 80, 1), width, height)
    assert str(raised.value) == (
        f'colour is {width} x {height} and depth 80 x 60 pixels, which is neither its size nor '
        'smaller by a whole factor: use the depth registered to the colour camera, or register '
        'it here (register_depth)')


@pytest.mark.parametrize('axis', [0, 1])
def test_whether_there_is_an_edge_does_not_depend_on_the_distance(axis):
    """A step of 4 % is none at any depth, and one of 6 % is; in both directions."""
    for depth in (0.3, 1.0, 8.0):
        for ratio, is_edge in ((1.04, False), (1.06, True)):
            small = np.full((8, 8), depth, np.float32)
            small[np.s_[4:] if axis == 0 else np.s_[:, 4:]] *= np.float32(ratio)
            between = ~np.isin(enlarge(small, 16, 16), small)
            assert between.any() != is_edge


def test_what_touches_an_edge_at_a_corner_only_is_a_block():
    small = (2.0 + 0.01 * np.arange(6) * np.ones((6, 1))).astype(np.float32)
    small[0, 0] = 1.0
    large = enlarge(small, 12, 12)
    np.testing.assert_array_equal(large[2:4, 2:4], np.full((2, 2), small[1, 1]))
    assert large[7, 7] != small[3, 3]


def test_no_depth_at_all_stays_none():
    assert np.isnan(enlarge(np.full((3, 4), np.nan, np.float32), 8, 6)).all()
    with pytest.raises(InputError, match='colour is 8 x 6 and depth 4 x 0 pixels, which is '):
        enlarge(np.empty((0, 4), np.float32), 8, 6)
