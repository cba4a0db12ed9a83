# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The walk along shelves: it goes from end to end, through nothing, and sees the shelves."""

import cv2
import numpy as np
import pytest

from aick_ros.sources.synthetic.corridor import WalkingPath, corridor
from aick_ros.sources.synthetic.scene import Zone

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


def test_shelves_stand_along_the_left_wall_below_lamps(scene):
    blocks = np.array([[*b.T_world_block[:3, 3], *b.size] for b in scene.blocks])
    sides = blocks[np.isclose(blocks[:, 3:], (0.025, 0.3, 2.0)).all(axis=1)]
    np.testing.assert_allclose(sides[:, 1], 2.6 / 2 - 0.15)
    np.testing.assert_allclose(np.sort(sides[:, 0].round(9)), np.sort(np.concatenate(
        [np.arange(5) - 2.5 + 0.0125, np.arange(5) - 1.5 - 0.0125])))
    np.testing.assert_allclose(scene.interior.high, (LENGTH / 2, 1.3, 2.5))
    np.testing.assert_allclose(scene.interior.low, (-LENGTH / 2, -1.3, 0))
    lamps = [s for s in scene.surfaces if s.width == 1.2 and s.height == 0.3]
    np.testing.assert_allclose([s.hull.mean(axis=0) for s in lamps],
                               [(-1.0, 0, 2.47), (2.0, 0, 2.47)], atol=1e-12)
    # it is brighter below a lamp than between two
    floor = next(s for s in scene.surfaces if s.points(*np.zeros((2, 1)))[1][0, 2] > 0.9)
    light = cv2.resize(floor.image, (50, 1), interpolation=cv2.INTER_AREA)[0].mean(axis=1)
    assert light[13:18].mean() > 1.03 * light[27:32].mean()


def test_the_eye_is_where_the_zone_says(scene, poses):
    """A step to the right of the middle, level, with sway and steps of centimetres."""
    np.testing.assert_allclose(scene.free.low, (-LENGTH / 2 + 1.2, -0.3, 1.2))
    np.testing.assert_allclose(scene.free.high, (LENGTH / 2 - 1.2, 0.3, 1.6))
    places = poses[:, :3, 3]
    straight = np.column_stack([np.linspace(-1.3, 1.3, 101), np.full(101, -0.15),
                                np.full(101, 1.35)])
    assert (np.abs(places - straight).max(axis=0) < (0.054, 0.054, 0.026)).all()
    assert (np.abs(places - straight).max(axis=0) > (0.02, 0.02, 0.008)).all()


def test_looks_ahead_and_a_little_down():
    """Over many walks; 62 degrees from along the corridor, 8 below the horizon."""
    zone = Zone(np.array([0.0, -0.3, 1.2]), np.array([9.0, 0.3, 1.6]))
    forward = np.array([WalkingPath(np.random.default_rng(seed), zone, 9.0).pose(time)[:3, 2]
                        for seed in range(40) for time in np.linspace(0, 9, 10)])
    yaw = np.degrees(np.arctan2(forward[:, 1], forward[:, 0]))
    pitch = np.degrees(np.arcsin(forward[:, 2]))
    assert yaw.mean() == pytest.approx(62, abs=1.5)
    assert pitch.mean() == pytest.approx(-8, abs=0.8)
    assert 5 < yaw.std() < 12 and 2 < pitch.std() < 5
