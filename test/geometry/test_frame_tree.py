# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Chains of fixed and moving frames, written out by hand."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.frame_tree import FrameTree

SECOND = 10 ** 9


def pose(seed):
    return se3.exp(np.random.default_rng(seed).normal(0, 1, 6))


@pytest.fixture
def tree():
    tree = FrameTree()
    tree.fix('mast', 'head', pose(1))
    tree.fix('head', 'camera', pose(2))
    tree.fix('base', 'wheel', pose(3))
    return tree


def test_down_a_chain_and_up_another(tree):
    tree.fix('base', 'mast', pose(4))
    found = tree.find('wheel', 'camera', 0)
    np.testing.assert_allclose(
        found.T_target_source, np.linalg.inv(pose(3)) @ pose(4) @ pose(1) @ pose(2), atol=1e-9)
    assert found.is_fixed and found.gap == 0


def test_a_moving_link_is_interpolated(tree):
    """A mast that turns about its axis at a steady rate."""
    for i in range(5):
        tree.move('base', 'mast', (10 + i) * SECOND, se3.exp([0, 0, 0, 0, 0, 0.2 * i]))
    found = tree.find('base', 'camera', round(12.3 * SECOND))
    np.testing.assert_allclose(found.T_target_source,
                               se3.exp([0, 0, 0, 0, 0, 0.46]) @ pose(1) @ pose(2), atol=1e-9)
    assert not found.is_fixed and found.gap == 0


@pytest.mark.parametrize('seconds, gap, nearest', [(14.5, 0.5, 0.8), (9.75, 0.25, 0.0)])
def test_outside_of_what_is_known_the_nearest_and_how_far_off(tree, seconds, gap, nearest):
    for i in range(5):
        tree.move('base', 'mast', (10 + i) * SECOND, se3.exp([0, 0, 0, 0, 0, 0.2 * i]))
    found = tree.find('base', 'mast', round(seconds * SECOND))
    np.testing.assert_allclose(found.T_target_source, se3.exp([0, 0, 0, 0, 0, nearest]))
    assert found.gap == gap * SECOND


def test_a_clock_set_back_starts_a_moving_link_anew(tree):
    tree.move('base', 'mast', 100 * SECOND, pose(4))
    tree.move('base', 'mast', 10 * SECOND, pose(5))
    found = tree.find('base', 'mast', 10 * SECOND)
    np.testing.assert_allclose(found.T_target_source, pose(5))
    assert found.gap == 0


def test_nothing_is_guessed(tree):
    assert tree.find('base', 'camera', 0) is None
    assert tree.find('base', 'elsewhere', 0) is None
    np.testing.assert_array_equal(tree.find('base', 'base', 0).T_target_source, np.eye(4))


def test_a_loop_of_frames_ends(tree):
    tree.fix('base', 'mast', pose(4))
    tree.fix('camera', 'base', pose(5))
    assert tree.find('elsewhere', 'camera', 0) is None
    assert tree.find('base', 'camera', 0) is not None
