# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""True poses and motions of a camera that moves at constant velocity."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.ground_truth import (
    MAX_INTERPOLATION_GAP, MAX_SPARSE_GAP, longest_gap, true_motion, true_pose)
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory, read_trajectory, seconds_to_stamp

TWIST = np.array([0.3, -0.2, 0.1, 0.2, 0.4, -0.3])
START = se3.exp([1.0, 2.0, 3.0, 0.5, -0.4, 0.3])
GAP = round(MAX_INTERPOLATION_GAP * NANOSECONDS)


@pytest.fixture
def path():
    """Return poses as far apart as may be, then one nanosecond farther, and then at 100 Hz."""
    stamps = np.array([0, GAP, 2 * GAP, *(3 * GAP + 1 + 10 ** 7 * np.arange(6))])
    return Trajectory(stamps, np.array([START @ se3.exp(TWIST * stamp / GAP)
                                        for stamp in stamps]))


def test_a_motion_is_that_of_the_source_in_the_target(path):
    motion = true_motion(path, GAP, 2 * GAP)
    np.testing.assert_allclose(motion, se3.exp(TWIST), atol=1e-9)
    np.testing.assert_allclose(true_motion(path, 2 * GAP, GAP), se3.exp(-TWIST), atol=1e-9)
    np.testing.assert_allclose(true_pose(path, 0) @ true_motion(path, 0, GAP),
                               true_pose(path, GAP), atol=1e-9)


def test_poses_are_interpolated_up_to_the_longest_gap(path):
    halfway = true_pose(path, GAP // 2)
    np.testing.assert_allclose(halfway[:3, :3], (START @ se3.exp(TWIST / 2))[:3, :3], atol=1e-9)
    assert true_pose(path, 2 * GAP + 5) is None


@pytest.mark.parametrize('target, source', [(0, 2 * GAP + 5), (2 * GAP + 5, 0), (-1, 0)])
def test_without_one_of_the_poses_there_is_no_motion(path, target, source):
    assert true_motion(path, target, source) is None


@pytest.mark.parametrize('interval, longest', [
    (0.01, 0.05), (0.033, 0.05), (0.05, 0.075), (0.08, 0.12), (0.1, 0.15), (0.5, MAX_SPARSE_GAP)])
def test_longer_gaps_are_interpolated_where_the_poses_are_that_sparse_throughout(
        interval, longest):
    stamps = np.round(interval * NANOSECONDS * np.arange(40)).astype(np.int64)
    assert longest_gap(Trajectory(stamps, np.tile(np.eye(4), (40, 1, 1)))) == pytest.approx(
        longest)


def test_a_gap_stays_one_in_any_ground_truth():
    """Of a dense one, and of a sparse one of which a pose is missing."""
    for interval, longest in ((0.01, 0.06), (0.1, 0.2)):
        stamps = np.round(interval * NANOSECONDS * np.arange(40)).astype(np.int64)
        stamps[20:] += round((longest - interval) * NANOSECONDS)
        truth = Trajectory(stamps, np.tile(np.eye(4), (40, 1, 1)))
        assert true_pose(truth, int(stamps[19]) + 10 ** 6) is None
        assert true_pose(truth, int(stamps[18]) + 10 ** 6) is not None


@pytest.mark.parametrize('poses', [0, 1])
def test_one_pose_has_no_interval(poses):
    truth = Trajectory(np.arange(poses), np.tile(np.eye(4), (poses, 1, 1)))
    assert truth.median_interval == np.inf
    assert true_pose(truth, 5) is None


@pytest.mark.parametrize('name', ['freiburg1_xyz_150', 'freiburg1_rpy_100'])
def test_what_a_sparse_ground_truth_adds_is_small(tum_folder, name):
    """Of ten poses one is left; the dense ground truth is the oracle."""
    folder = tum_folder(name)
    dense = read_trajectory(folder / 'groundtruth.txt')
    sparse = Trajectory(dense.stamps[::10], dense.poses[::10])
    lines = (folder / 'rgb.txt').read_text().splitlines()
    stamps = [seconds_to_stamp(line.split()[0]) for line in lines if line[0] != '#']
    poses = [(true_pose(dense, stamp), true_pose(sparse, stamp)) for stamp in stamps]
    errors = np.array([se3.difference(second, first) for first, second in poses
                       if first is not None and second is not None])
    assert len(errors) >= len(stamps) - 4
    distances, angles = (np.linalg.norm(part, axis=1) for part in np.split(errors, 2, axis=1))
    assert np.sqrt(np.mean(distances ** 2)) < 1.2e-3
    assert np.degrees(np.sqrt(np.mean(angles ** 2))) < 0.6
