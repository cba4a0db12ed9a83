# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of increments, accepted and rejected, in runs whose errors are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.run_errors import RunErrors, SilentFailures
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

PERIOD = NANOSECONDS // 30
START = 1_305_031_102 * NANOSECONDS
SIGMA = 0.01


@pytest.fixture
def ground_truth():
    """Return 20 poses of a camera that turns and moves."""
    rng = np.random.default_rng(4)
    poses = [se3.exp(rng.normal(0, 1, 6))]
    for _ in range(19):
        poses.append(poses[-1] @ se3.exp(rng.normal(0, 0.05, 6)))
    return Trajectory(START + PERIOD * np.arange(20), np.array(poses))


def record(ground_truth, index, back=1, error=(0, 0, 0, 0, 0, 0), accepted=True):
    """Return the record of a frame registered to one ``back`` frames before, with an error."""
    increment = np.linalg.inv(ground_truth.poses[index - back]) @ ground_truth.poses[index]
    increment[:3, 3] += error[:3]
    increment[:3, :3] = Rotation.from_rotvec(error[3:]).as_matrix() @ increment[:3, :3]
    measured = Increment(PoseWithCovariance(increment, SIGMA ** 2 * np.eye(6)),
                         back * PERIOD / NANOSECONDS)
    return FrameRecord(
        stamp=int(ground_truth.stamps[index]), reason='', keypoints=300, matches=100,
        status=Status.OK if accepted else Status.MOTION_GATE,
        pose=PoseWithCovariance(np.eye(4), np.eye(6)), timing={},
        **{'increment' if accepted else 'rejected': measured})


@pytest.mark.parametrize('back', [1, 3])
def test_errors_are_about_the_targets_axes(ground_truth, back):
    added = np.array([0.01, -0.02, 0.005, 0.03, 0.01, -0.02])
    errors = RunErrors.of([record(ground_truth, 7, back, added)], ground_truth)
    [error] = errors.accepted
    assert error.translation == pytest.approx(np.linalg.norm(added[:3]), rel=1e-6)
    assert error.rotation == pytest.approx(np.linalg.norm(added[3:]), rel=1e-6)
    assert error.nees == pytest.approx(np.sum(added ** 2) / SIGMA ** 2, rel=1e-6)
    assert errors.rejected == []


def test_silent_failures_are_counted_both_ways(ground_truth):
    accepted = [(0.049, 0), (0.051, 0), (0, 2.9), (0, 3.1), (0.06, 10), (0, 0), (0, 4)]
    refused = [(0.049, 2.9), (0.051, 0), (0, 3.1)]
    records = [record(ground_truth, i, 1, (x, 0, 0, 0, 0, np.radians(turn)), i <= len(accepted))
               for i, (x, turn) in enumerate(accepted + refused, 1)]
    failures = SilentFailures.of(RunErrors.of(records, ground_truth))
    assert failures == SilentFailures(reported_good=7, reported_good_but_off=4, refused=3,
                                      refused_but_good=1)


def test_what_cannot_be_judged_does_not_enter(ground_truth):
    first = record(ground_truth, 5)
    first = FrameRecord(**{**vars(first), 'status': Status.FIRST_FRAME, 'increment': None})
    records = [first, record(ground_truth, 12), record(ground_truth, 12, accepted=False)]
    hole = np.delete(np.arange(20), [10, 11])  # 0.1 s without ground truth
    with_hole = Trajectory(ground_truth.stamps[hole], ground_truth.poses[hole])
    assert RunErrors.of(records, with_hole) == RunErrors([], [])
    assert len(RunErrors.of(records, ground_truth).accepted) == 1
    assert SilentFailures.of(None).reported_good is None


def test_an_error_of_180_degrees_is_wrong():
    """The logarithm must not fail where it is least defined."""
    error = IncrementError.of(np.diag([1.0, -1, -1, 1]), np.eye(6), np.eye(4))
    assert error.rotation == pytest.approx(np.pi)
    assert error.is_wrong
