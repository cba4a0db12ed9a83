# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""RPE and ATE against evo, and against pairs found one by one."""

import copy

import numpy as np
import pytest
from evo.core import lie_algebra, metrics
from evo.core.trajectory import PoseTrajectory3D

from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

SECOND = 30
START = 1_305_031_102 * NANOSECONDS


def random_walk(seed, count, sigma):
    rng = np.random.default_rng(seed)
    poses = [se3.exp(rng.normal(0, 1, 6))]
    for _ in range(count - 1):
        poses.append(poses[-1] @ se3.exp(rng.normal(0, sigma, 6)))
    return np.array(poses)


def drifting(truth, seed):
    """Return an estimate in a frame of its own that drifts away from the truth."""
    drift = random_walk(seed, len(truth), 0.004)
    return se3.exp([1, -2, 3, 0.3, 1.1, -0.7]) @ truth @ drift


@pytest.fixture
def regular():
    """Return estimate and truth at the same regular stamps, so that evo needs no association."""
    stamps = START + np.arange(200) * NANOSECONDS // SECOND
    truth = random_walk(1, 200, 0.02)
    return Trajectory(stamps, drifting(truth, 2)), Trajectory(stamps, truth)


def for_evo(trajectory):
    return PoseTrajectory3D(poses_se3=list(trajectory.poses),
                            timestamps=trajectory.stamps / NANOSECONDS)


def by_evo(metric, truth, estimate):
    metric.process_data((truth, estimate))
    return metric.get_statistic(metrics.StatisticsType.rmse)


@pytest.mark.parametrize('relation, index', [
    (metrics.PoseRelation.translation_part, 0), (metrics.PoseRelation.rotation_angle_rad, 1)])
def test_relative_errors_are_those_of_evo(regular, relation, index):
    estimate, truth = regular
    expected = by_evo(metrics.RPE(relation, SECOND, metrics.Unit.frames, all_pairs=True),
                      for_evo(truth), for_evo(estimate))
    errors = compare(estimate, truth).relative(1.0)[index]
    assert len(errors) == 200 - SECOND
    assert root_mean_square(errors) == pytest.approx(expected, rel=1e-9)


def test_absolute_error_is_that_of_evo(regular):
    estimate, truth = regular
    aligned = copy.deepcopy(for_evo(estimate))
    aligned.align(for_evo(truth))
    expected = by_evo(metrics.APE(metrics.PoseRelation.translation_part), for_evo(truth), aligned)
    errors = compare(estimate, truth)
    assert root_mean_square(errors.positions()) == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(errors.aligned, aligned.poses_se3, atol=1e-9)


def test_pairs_of_an_irregular_camera_are_the_nearest_ones():
    rng = np.random.default_rng(3)
    numbers = np.delete(np.arange(120), [17, 18, 50, 51, 52, 53, 90])
    stamps = START + numbers * NANOSECONDS // 30 + rng.integers(-9_000_000, 9_000_000, 113)
    truth = random_walk(4, 113, 0.02)
    estimate = drifting(truth, 5)
    limit = np.median(np.diff(stamps)) / 2
    expected = []
    for i in range(113):
        distances = [abs(int(stamp) - int(stamps[i]) - NANOSECONDS) for stamp in stamps]
        j = int(np.argmin(distances))
        if distances[j] < limit:
            expected.append(lie_algebra.relative_se3(
                lie_algebra.relative_se3(truth[i], truth[j]),
                lie_algebra.relative_se3(estimate[i], estimate[j])))
    translations, rotations = compare(Trajectory(stamps, estimate),
                                      Trajectory(stamps, truth)).relative(1.0)
    assert 0 < len(expected) < 113 - 30
    np.testing.assert_allclose(translations, [np.linalg.norm(E[:3, 3]) for E in expected],
                               atol=1e-9)
    np.testing.assert_allclose(
        rotations, [lie_algebra.so3_log_angle(E[:3, :3]) for E in expected], atol=1e-7)


def test_truth_is_interpolated_and_gaps_are_skipped():
    velocity = np.array([0.3, -0.1, 0.2])
    times = np.delete(np.arange(0, 400), np.arange(100, 120))  # 100 Hz, a hole of 0.2 s
    truth = Trajectory(START + times * 10_000_000, line(times * 0.01, velocity))
    stamps = START + 5_000_000 + np.arange(-10, 140) * 33_000_000  # before, through, after
    seconds = (stamps - START) / NANOSECONDS
    errors = compare(Trajectory(stamps, line(seconds, velocity)), truth)
    covered = (seconds > 0) & (seconds < 3.99) & ((seconds < 0.99) | (seconds > 1.2))
    np.testing.assert_array_equal(errors.estimate.stamps, stamps[covered])
    np.testing.assert_allclose(errors.truth.poses, line(seconds[covered], velocity), atol=1e-9)


def test_nothing_to_compare():
    poses = random_walk(6, 5, 0.1)
    early = Trajectory(START + np.arange(5), poses)
    assert compare(early, Trajectory(early.stamps + NANOSECONDS, poses)) is None


def test_rotation_error_does_not_hang_on_the_positions():
    """A straight path leaves the turn about itself open; the rotations do not."""
    rng = np.random.default_rng(7)
    truth = line(np.linspace(0, 1, 60), np.array([1.0, 0, 0]))
    estimate = truth.copy()
    estimate[:, :3, 3] += rng.normal(0, 1e-3, (60, 3))
    estimate[:, :3, :3] = [se3.exp_rotation(rng.normal(0, 0.01, 3)) for _ in range(60)]
    stamps = START + np.arange(60) * NANOSECONDS // 30
    errors = compare(Trajectory(stamps, estimate), Trajectory(stamps, truth))
    assert np.degrees(errors.rotations()).max() < 3


@pytest.mark.parametrize('velocity', [(0, 0, 0), (0.5, 0, 0), (0.1, -0.3, 0.2)])
def test_standing_still_and_straight_paths_have_an_error_too(velocity):
    seconds = np.arange(60) / 30
    truth = line(seconds, np.array(velocity, float))
    T_odom_world = se3.exp([1, 2, 3, 0.5, -0.4, 0.9])
    stamps = START + np.arange(60) * NANOSECONDS // 30
    exact = compare(Trajectory(stamps, T_odom_world @ truth), Trajectory(stamps, truth))
    assert exact.positions().max() < 1e-9
    assert exact.rotations().max() < 1e-7

    # a bump across the path: the best fit leaves it where it is, but for its mean
    bumped = truth.copy()
    bumped[30, 2, 3] += 0.06
    errors = compare(Trajectory(stamps, T_odom_world @ bumped), Trajectory(stamps, truth))
    assert errors.positions().max() == pytest.approx(0.059, abs=2e-3)


def line(seconds, velocity):
    poses = np.tile(np.eye(4), (len(seconds), 1, 1))
    poses[:, :3, 3] = np.outer(seconds, velocity)
    return poses
