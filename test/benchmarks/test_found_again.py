# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What counts as a false reuse of a keyframe, and a path without any."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

FOLDER = Path(__file__).parents[2] / 'benchmarks'
STAMPS = np.array([0, NANOSECONDS])
TRUTH = Trajectory(STAMPS, np.array([se3.exp([1, 2, 3, 0.1, 0.2, 0.3]),
                                     se3.exp([1.5, 2, 3, 0.1, 0.5, 0.3])]))


@pytest.fixture(scope='module')
def false_reuses(load):
    return load(FOLDER / 'false_reuses.py')


@pytest.mark.parametrize(('millimetres', 'degrees', 'sigma', 'is_off', 'is_false'), [
    (40, 0, 1e-3, False, False),  # far outside of its covariance, but not off
    (60, 0, 1e-3, True, True),
    (60, 0, 0.05, True, False),  # as uncertain as it is off
    (0, 4, 1e-3, True, True),
    (0, 2, 1e-3, False, False),
])
def test_a_reuse_is_false_if_it_is_off_and_its_covariance_denies_it(
        false_reuses, millimetres, degrees, sigma, is_off, is_false):
    motion = se3.inverse(TRUTH.poses[0]) @ TRUTH.poses[1]
    wrong = se3.perturbed(motion, np.array([1e-3 * millimetres, 0, 0, 0, 0, np.radians(degrees)]))
    covariance = np.diag(np.full(6, sigma ** 2))
    reuse = false_reuses.Reuse(0, NANOSECONDS, PoseWithCovariance(wrong, covariance))
    error = reuse.error(TRUTH)
    assert 1e3 * error.translation == pytest.approx(millimetres, abs=1e-6)
    assert (error.is_wrong, false_reuses.is_false(error)) == (is_off, is_false)


def test_a_reuse_that_the_ground_truth_does_not_cover_has_no_error(false_reuses):
    reuse = false_reuses.Reuse(0, 9 * NANOSECONDS, PoseWithCovariance.identity())
    assert reuse.error(TRUTH) is None


@pytest.mark.parametrize('room, frames', [(9042, 17), (9047, 13), (9096, 16)])
def test_where_a_room_repeats_itself_no_increment_is_off_by_a_piece_of_furniture(
        false_reuses, room, frames):
    """Most keypoints confirm both motions there, and a few do one of them alone."""
    assert false_reuses.walked(room, 8.0, frames).slips == 0


def test_one_mistake_is_named(false_reuses):
    motion = se3.inverse(TRUTH.poses[0]) @ TRUTH.poses[1]
    wrong = PoseWithCovariance(se3.perturbed(motion, np.array([0.1, 0, 0, 0, 0, 0])),
                               1e-6 * np.eye(6))
    error = false_reuses.Reuse(0, NANOSECONDS, wrong).error(TRUTH)
    assert false_reuses.Tally(rooms=3).mistakes == ''
    for tally, named in ((false_reuses.Tally(rooms=3, slips=1), '1 increments are off and 0 '),
                         (false_reuses.Tally(rooms=3, walk=[error]), 'and 1 reuses are false'),
                         (false_reuses.Tally(rooms=3, drift=[error]), 'and 1 reuses are false')):
        assert named in tally.mistakes and '3 rooms' in tally.mistakes


def test_a_path_without_memory_is_that_of_the_increments(load):
    walks = load(FOLDER / 'returning_walks.py')
    step = PoseWithCovariance(se3.exp([0.1, 0.0, 0.0, 0.0, 0.0, np.pi / 2]), np.eye(6))
    corrected = PoseWithCovariance(se3.exp([9.0, 9.0, 9.0, 0.0, 0.0, 0.0]))
    updates = [SimpleNamespace(pose=PoseWithCovariance.identity(), increment=None)] + 4 * [
        SimpleNamespace(pose=corrected, increment=Increment(step, 1.0))]
    path = walks.reckoned(updates)
    np.testing.assert_allclose(path[-1].matrix, np.eye(4), atol=1e-12)  # once around a square
    assert len(path) == 5
