# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The walk along shelves: it goes from end to end, through nothing, and sees the shelves."""

import numpy as np
import pytest

from aick_ros.sources.synthetic.corridor import WalkingPath, corridor

LENGTH, DURATION = 5.0, 10.0


@pytest.fixture(scope='module')
def scene():
    return corridor(3, LENGTH)


@pytest.fixture
def poses(scene):
    path = WalkingPath(np.random.default_rng(1), scene.free, DURATION)
    return np.array([path.pose(time) for time in np.linspace(0, DURATION, 101)])


def test_goes_from_end_to_end(poses):
    walked = poses[-1, 0, 3] - poses[0, 0, 3]
    assert LENGTH - 2.6 < walked < LENGTH - 2.2
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    assert steps.max() < 0.1  # m in a tenth of a second


def test_walks_into_nothing(scene, poses):
    assert scene.clearance(poses[:, :3, 3]).min() > 0.4


def test_looks_at_the_shelves(poses):
    """They are on the left of who walks along x: towards y."""
    forward, down = poses[:, :3, 2], poses[:, :3, 1]
    assert forward[:, 1].min() > 0.5
    assert down[:, 2].max() < -0.9


def test_is_the_same_for_the_same_seed(scene):
    again = corridor(3, LENGTH)
    assert all(np.array_equal(a.image, b.image)
               for a, b in zip(scene.surfaces, again.surfaces, strict=True))
