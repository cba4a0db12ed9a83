# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The score of a run whose errors are known."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

PERIOD = NANOSECONDS // 10
COUNT = 60


def records(poses, lost=()):
    return [FrameRecord(i * PERIOD, Status.TOO_FEW_MATCHES if i in lost else Status.OK, '',
                        PoseWithCovariance(pose), 1, 1, {}) for i, pose in enumerate(poses)]


def path():
    return np.array([se3.exp([0.1 * i, 0.5 * np.sin(0.2 * i), 0.01 * i ** 1.5, 0, 0, 0])
                     for i in range(COUNT)])


def truth(poses):
    return Trajectory(PERIOD * np.arange(COUNT), poses)


def test_a_turn_of_each_second_is_the_error_in_a_second():
    """A camera on a circle that turns by 2 degrees a second too much, where it stands."""
    true = np.tile(np.eye(4), (COUNT, 1, 1))
    estimate = np.array([se3.exp([0, 0, 0, 0, 0, np.radians(0.2 * i)]) for i in range(COUNT)])
    score = TrajectoryScore.of(records(estimate), truth(true))
    assert score.rpe_1s_rotation_rmse_deg == pytest.approx(2.0)
    assert score.rpe_1s_translation_rmse_m == pytest.approx(0.0, abs=1e-9)


def test_errors_of_positions_are_root_mean_squares():
    """Up and down by 3 mm in turn: at an interval of ten frames the error is the same."""
    poses = path()
    shaken = poses.copy()
    shaken[:, 2, 3] += 0.003 * (-1.0) ** np.arange(COUNT)
    score = TrajectoryScore.of(records(shaken), truth(poses))
    assert score.ate_rmse_m == pytest.approx(0.003, rel=0.01)
    assert score.rpe_1s_translation_rmse_m == pytest.approx(0.0, abs=1e-9)
    shaken = poses.copy()
    shaken[COUNT // 2:, 2, 3] += 0.02  # between ten of the fifty pairs a second apart
    score = TrajectoryScore.of(records(shaken), truth(poses))
    assert score.rpe_1s_translation_rmse_m == pytest.approx(0.02 * np.sqrt(10 / 50))


def test_the_frame_of_the_estimate_does_not_matter():
    poses = path()
    score = TrajectoryScore.of(records(se3.exp([1, 2, 3, 0.4, 0.5, 0.6]) @ poses), truth(poses))
    assert max(score.ate_rmse_m, score.rpe_1s_translation_rmse_m) < 1e-9


def test_lost_frames_are_not_tracked_and_their_poses_count():
    poses = path()
    held = poses.copy()
    held[30:40] = held[30]
    score = TrajectoryScore.of(records(held, lost=range(30, 40)), truth(poses))
    assert score.tracked_fraction == pytest.approx(5 / 6)
    assert score.ate_rmse_m > 0.05


@pytest.mark.parametrize('ground_truth, covered', [(None, None), (Trajectory(
    np.array([10 ** 15, 10 ** 15 + 1]), np.tile(np.eye(4), (2, 1, 1))), 0)])
def test_without_truth_at_its_time_only_the_tracked_share_is_known(ground_truth, covered):
    score = TrajectoryScore.of(records(path(), lost=[0]), ground_truth)
    assert score == TrajectoryScore(None, None, None, pytest.approx((COUNT - 1) / COUNT), covered)


@pytest.mark.parametrize('count', [2, 6, COUNT])
def test_frames_that_the_truth_covers_are_counted(count):
    """A run whose ground truth ended early has an ATE, of few frames."""
    poses = path()
    short = Trajectory(PERIOD * np.arange(count), poses[:count])
    score = TrajectoryScore.of(records(poses), short)
    assert (score.covered_frames, score.ate_rmse_m is None) == (count, False)


def test_no_frames_have_no_score():
    assert TrajectoryScore.of([], truth(path())) == TrajectoryScore(
        None, None, None, None, 0)


@pytest.mark.parametrize('count', [1, 2])
def test_one_pose_has_no_error_as_it_is_aligned_to_any_other(count):
    poses = path()
    score = TrajectoryScore.of(records(poses[:count]), truth(poses))
    assert (score.ate_rmse_m is None) == (count == 1)
