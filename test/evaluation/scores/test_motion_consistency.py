# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Consistency along simulated walks whose increments have errors drawn from their covariances."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.motion_consistency import (
    TRAJECTORY_GAPS, gap_consistency, pose_consistency, reference_poses)
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

PERIOD = NANOSECONDS // 10
COUNT = 400
COVARIANCE = np.diag(np.square([0.002, 0.001, 0.004, 0.002, 0.001, 0.003]))


def record(index, pose, start=None, increment=None, status=Status.OK):
    """Return the record of a frame, registered to the frame of a number."""
    motion = None if increment is None else Increment(increment, (index - start) / 10.0)
    return FrameRecord(index * PERIOD, status, '', pose, 0, 0, {}, motion)


def walk(count=COUNT, covariance=COVARIANCE, seed=1):
    """Return the records of a walk by dead reckoning, and its ground truth in another frame."""
    rng = np.random.default_rng(seed)
    steps = [se3.exp(rng.normal(0, 0.05, 6)) for _ in range(count - 1)]
    true, pose = [se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])], PoseWithCovariance.identity()
    records = [record(0, pose, status=Status.FIRST_FRAME)]
    for index, step in enumerate(steps, 1):
        error = rng.multivariate_normal(np.zeros(6), COVARIANCE)
        increment = PoseWithCovariance(se3.perturbed(step, error), covariance)
        pose = pose @ increment
        true.append(true[-1] @ step)
        records.append(record(index, pose, index - 1, increment))
    return records, Trajectory(np.arange(count) * PERIOD, np.array(true))


@pytest.fixture(scope='module')
def walked():
    return walk()


def composed(increments):
    """Return motions composed one by one, the effect of each error on the end point by point."""
    estimate, covariance = np.eye(4), np.zeros((6, 6))
    for motion in increments:
        arm = estimate[:3, :3] @ motion.matrix[:3, 3]
        lever = np.eye(6)
        lever[:3, 3:] = np.cross(np.eye(3), arm).T  # theta x arm
        axes = np.kron(np.eye(2), estimate[:3, :3])
        covariance = lever @ covariance @ lever.T + axes @ motion.covariance @ axes.T
        estimate = estimate @ motion.matrix
    return estimate, covariance


@pytest.mark.parametrize('gap', [1, 10])
def test_motions_agree_with_increments_composed_one_by_one(walked, gap):
    records, truth = walked
    first = 200 - gap
    score = gap_consistency(records[:201], truth, [gap])[gap]
    before = gap_consistency(records[:200], truth, [gap])[gap]
    estimate, covariance = composed(
        [record.increment.pose for record in records[first + 1:first + gap + 1]])
    wanted = np.linalg.inv(truth.poses[first]) @ truth.poses[first + gap]
    turn = Rotation.from_matrix(estimate[:3, :3] @ wanted[:3, :3].T).as_rotvec()
    error = np.r_[estimate[:3, 3] - wanted[:3, 3], turn]
    for name, part in (('joint', slice(0, 6)), ('translation', slice(0, 3)),
                       ('rotation', slice(3, 6))):
        expected = error[part] @ np.linalg.inv(covariance[part, part]) @ error[part]
        sums = [getattr(s, name).nees_mean * s.count for s in (score, before)]
        assert sums[0] - sums[1] == pytest.approx(expected, rel=1e-6)


def test_right_covariances_are_called_right_at_every_gap(walked):
    scores = gap_consistency(*walked)
    assert tuple(scores) == TRAJECTORY_GAPS == (1, 10, 30, 100)
    for gap, score in scores.items():
        assert score.count == COUNT - gap
        independent = COUNT / gap  # at least so many motions overlap no other
        for part, dof in ((score.joint, 6), (score.translation, 3), (score.rotation, 3)):
            assert part.dof == dof
            sigma = (2 * dof / independent) ** 0.5
            assert part.nees_mean == pytest.approx(dof, abs=5 * sigma)
            assert part.inside_95 > 0.95 - 5 * (0.95 * 0.05 / independent) ** 0.5


def test_a_covariance_that_is_too_small_shows_in_its_part_alone():
    claimed = COVARIANCE.copy()
    claimed[3:, 3:] /= 16.0
    score = gap_consistency(*walk(300, claimed), [1])[1]
    assert score.rotation.nees_mean > 30.0
    assert 2.0 < score.translation.nees_mean < 4.5


def test_the_truth_is_moved_to_the_first_pose_that_it_covers():
    records, truth = walk(12)
    moved = reference_poses(records[4:], truth)
    np.testing.assert_allclose(moved[0][1], records[4].T_odom_camera, atol=1e-12)
    for (_, before), (_, now), index in zip(moved, moved[1:], range(4, 12)):
        np.testing.assert_allclose(
            se3.inverse(before) @ now,
            se3.inverse(truth.poses[index]) @ truth.poses[index + 1], atol=1e-12)


def test_poses_are_scored_from_the_first_one_on():
    values = []
    for seed in range(24):
        records, truth = walk(12, seed=seed)
        last = pose_consistency([records[0], records[-1]], truth)
        values.append((last.joint.nees_mean, last.translation.nees_mean))
    assert pose_consistency(records, truth).count == 11
    sigma = (12 / len(values)) ** 0.5
    assert np.mean(values, axis=0) == pytest.approx([6.0, 3.0], abs=5 * sigma)


def test_no_motion_crosses_a_gap_that_was_bridged():
    records, truth = walk(8)
    lost = record(4, records[4].pose, status=Status.TOO_FEW_MATCHES)
    bridged = record(5, records[5].pose, 2, records[5].increment.pose)
    found = gap_consistency([*records[:4], lost, bridged, *records[6:]], truth, [1, 2])
    # 0-1, 1-2, 2-3 and 5-6, 6-7; over two frames 0-2, 1-3 and 5-7
    assert (found[1].count, found[2].count) == (5, 3)


def test_a_motion_after_a_lost_frame_goes_on_from_the_last_tracked_one():
    records, truth = walk(6)
    lost = record(3, records[3].pose, status=Status.TOO_FEW_MATCHES)
    step = records[3].increment.pose @ records[4].increment.pose
    found = gap_consistency([*records[:3], lost, record(4, records[4].pose, 2, step), records[5]],
                            truth, [2])
    assert found[2].count == 2  # 0-2 and 2-4


def test_a_motion_from_a_lost_frame_begins_a_path():
    """What the camera moved before, since the last tracked frame, is in no increment."""
    records, truth = walk(6)
    lost = record(3, records[3].pose, status=Status.TOO_FEW_MATCHES)
    found = gap_consistency([*records[:3], lost, *records[4:]], truth, [1, 2])
    assert (found[1].count, found[2].count) == (3, 1)  # 0-1, 1-2 and 4-5; 0-2


def test_an_infinite_covariance_ends_a_path():
    records, truth = walk(6)
    step = PoseWithCovariance(records[3].increment.pose.matrix, np.diag([np.inf] * 6))
    found = gap_consistency([*records[:3], record(3, records[3].pose, 2, step), *records[4:]],
                            truth, [1])
    assert found[1].count == 4


def test_without_ground_truth_there_is_nothing():
    records, _ = walk(4)
    assert gap_consistency(records, None, [1])[1].count == 0
    assert pose_consistency(records, None).joint.nees_mean is None
