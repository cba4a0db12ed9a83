# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The files of --export, read as the description of their format says."""

import dataclasses

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from aick_ros import __version__
from aick_ros.cli.output.square_files import write_square
from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.motion_consistency import pose_consistency
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory, write_trajectory
from aick_ros.registration.status import Status

START = 1_700_000_000 * NANOSECONDS


def square(path):
    """Return header and rows of a file: #%KEY VALUE lines, then numbers."""
    lines = path.read_text().splitlines()
    header = dict(line[2:].split(' ', 1) for line in lines if line.startswith('#%'))
    return header, np.array([line.split() for line in lines if line[0] != '#'], float)


@pytest.fixture
def walk():
    """Return records whose poses have errors drawn from their covariances, and the truth."""
    rng = np.random.default_rng(1)
    T_world_odom = se3.exp([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])
    true = [np.eye(4), *(se3.exp(rng.normal(0, 0.7, 6)) for _ in range(300))]
    records = []
    for index, pose in enumerate(true):
        mixed = rng.normal(size=(6, 6)) * [[0.01]] * 3 + 0.002 * np.eye(6)
        covariance = mixed @ mixed.T if index else np.zeros((6, 6))
        estimate = se3.perturbed(pose, rng.multivariate_normal(np.zeros(6), covariance))
        records.append(FrameRecord(START + index * 33_333_333, Status.OK, '',
                                   PoseWithCovariance(estimate, covariance), 0, 0, {}))
    stamps = np.array([record.stamp for record in records])
    return records, Trajectory(stamps, T_world_odom @ np.array(true))


def test_the_errors_of_the_files_have_the_nees_of_the_poses(walk, tmp_path):
    write_square(tmp_path, *walk)
    header, estimate = square(tmp_path / 'estimate.SQUARE')
    other, reference = square(tmp_path / 'reference.SQUARE')
    assert header['FORMAT'] == other['FORMAT'] == 'SQUARE/0.3'
    assert (header['REPRESENTATION'], other['REPRESENTATION']) == ('gaussian_se3', 'deterministic')
    assert header['TANGENT_CONVENTION'] == 'right_perturbation'
    assert estimate.shape == (300, 29)
    assert reference.shape == (301, 8)
    lower, nees = np.tril_indices(6), []
    for row, true in zip(estimate, reference[1:]):
        assert row[0] == pytest.approx(true[0], abs=1e-6)
        R, R_true = (Rotation.from_quat(line[4:8]) for line in (row, true))
        # T_true = T_estimate exp(xi), xi in the axes of the body
        xi = np.r_[R.inv().apply(true[1:4] - row[1:4]), (R.inv() * R_true).as_rotvec()]
        covariance = np.zeros((6, 6))
        covariance[lower] = row[8:]
        covariance += np.tril(covariance, -1).T
        nees.append(xi @ np.linalg.solve(covariance, xi))
    assert np.mean(nees) == pytest.approx(6.0, abs=5 * (12 / 300) ** 0.5)
    assert np.mean(nees) == pytest.approx(pose_consistency(*walk).joint.nees_mean, rel=1e-3)


def test_the_headers_say_whose_poses_these_are(walk, tmp_path):
    write_square(tmp_path, *walk)
    header, _ = square(tmp_path / 'estimate.SQUARE')
    other, _ = square(tmp_path / 'reference.SQUARE')
    for name in ('estimate', 'reference'):
        assert (tmp_path / f'{name}.SQUARE').read_text().startswith('#%FORMAT SQUARE/0.3\n#%')
    both = {'FORMAT': 'SQUARE/0.3', 'POSE_FRAME': 'odom', 'BODY_FRAME': 'camera',
            'GAUGE': 'fixed', 'TIMESTAMP_UNIT': 'seconds', 'ALGORITHM': 'aick_ros',
            'ALGORITHM_VERSION': __version__}
    assert other == {**both, 'REPRESENTATION': 'deterministic'}
    assert header == {**both, 'REPRESENTATION': 'gaussian_se3',
                      'TANGENT_CONVENTION': 'right_perturbation',
                      'TANGENT_ORDER': 'translation_rotation', 'ROTATION_PARAM': 'axis_angle'}


@pytest.mark.parametrize('variance', [0.0, np.inf])
def test_a_pose_with_one_axis_that_is_not_known_or_exact_is_omitted(walk, tmp_path, variance):
    records, truth = walk
    some = PoseWithCovariance(np.eye(4), np.diag([1.0, 1.0, 1.0, 1.0, 1.0, variance]))
    odd = FrameRecord(records[1].stamp, Status.OK, '', some, 0, 0, {})
    write_square(tmp_path, [records[0], odd, records[2]], truth)
    assert len(square(tmp_path / 'estimate.SQUARE')[1]) == 1


def test_poses_that_claim_nothing_or_too_much_are_omitted(walk, tmp_path):
    records, truth = walk
    held = PoseWithCovariance(np.eye(4), np.diag([np.inf] * 6))
    lost = FrameRecord(records[1].stamp, Status.TOO_FEW_MATCHES, '', held, 0, 0, {})
    write_square(tmp_path, [records[0], lost, records[2]], truth)
    _, estimate = square(tmp_path / 'estimate.SQUARE')
    assert list(estimate[:, 0]) == pytest.approx([records[2].stamp / NANOSECONDS])


def test_without_ground_truth_there_is_no_reference(walk, tmp_path):
    write_square(tmp_path, walk[0], None)
    assert [path.name for path in tmp_path.iterdir()] == ['estimate.SQUARE']


def test_evo_has_the_same_ate_with_the_interpolated_ground_truth(walk, tmp_path):
    """With the nearest pose instead its ATE is another one."""
    true = walk[1].poses
    stamps = START + 10_000_000 * np.arange(1001, dtype=np.int64)
    truth = Trajectory(stamps, np.tile(np.eye(4), (len(stamps), 1, 1)))
    truth.poses[:, :3, 3] = np.array([np.sin(stamps * 2e-9 + axis) for axis in range(3)]).T
    records = [dataclasses.replace(record, pose=PoseWithCovariance(
        truth.at(record.stamp) @ se3.exp(0.003 * pose[0, :3].repeat(2)), record.pose.covariance))
        for record, pose in zip(walk[0], true)]
    write_square(tmp_path, records, truth)
    write_trajectory(tmp_path / 'truth.tum', truth)
    write_trajectory(tmp_path / 'estimate.tum', trajectory_of(records))
    ate = TrajectoryScore.of(records, truth).ate_rmse_m
    assert evo_ate(tmp_path / 'reference.SQUARE', tmp_path / 'estimate.tum') == pytest.approx(
        ate, rel=1e-3)
    assert evo_ate(tmp_path / 'truth.tum', tmp_path / 'estimate.tum') > 1.05 * ate


def evo_ate(truth, estimate):
    """Return the ATE as the command evo_ape computes it with -a."""
    pair = sync.associate_trajectories(
        *(file_interface.read_tum_trajectory_file(str(path)) for path in (truth, estimate)))
    pair[1].align(pair[0])
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data(pair)
    return error.get_statistic(metrics.StatisticsType.rmse)
