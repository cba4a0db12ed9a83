# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of frames: read as it was written, and damaged ones rejected."""

import csv

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aick_ros.errors import InputError
from aick_ros.evaluation.runs.frames_csv import cells, columns, read_frames
from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of, trajectory_of
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.registration.status import Status


def covariance(rng):
    root = 1e-3 * rng.normal(size=(6, 6))
    return root @ root.T


@pytest.fixture
def records():
    """Return a first frame, a tracked one, and a lost one whose covariance is infinite."""
    rng = np.random.default_rng(3)
    motion = se3.exp(rng.normal(0, 0.1, 6))
    tracked = PoseWithCovariance(motion, covariance(rng))
    return [
        FrameRecord(1_000_000_001, Status.FIRST_FRAME, '', PoseWithCovariance.identity(), 310, 0,
                    {'features': 1.5, 'total': 2.25}),
        FrameRecord(1_033_333_334, Status.OK, '', tracked, 300, 120,
                    {'features': 1.25, 'total': 4.5}, Increment(tracked, 0.033333333)),
        FrameRecord(1_066_666_667, Status.TOO_FEW_MATCHES, 'a reason, with "quotes"',
                    PoseWithCovariance(motion, np.full((6, 6), np.inf)), 5, 2, {'total': 1.0})]


@pytest.fixture
def path(tmp_path, records):
    stages = stages_of(records)
    with open(tmp_path / 'frames.csv', 'w', newline='') as file:
        table = csv.writer(file, lineterminator='\n')
        table.writerow(columns(stages))
        table.writerows(cells(record, stages) for record in records)
    return tmp_path / 'frames.csv'


def test_frames_are_read_as_written(path, records):
    for read, written in zip(read_frames(path, trajectory_of(records)), records, strict=True):
        assert (read.stamp, read.status, read.reason, read.keypoints, read.matches, read.timing
                ) == (written.stamp, written.status, written.reason, written.keypoints,
                      written.matches, written.timing)
        np.testing.assert_array_equal(read.pose.matrix, written.pose.matrix)
        np.testing.assert_allclose(read.pose.covariance, written.pose.covariance, rtol=1e-11)
        assert (read.increment is None) == (written.increment is None)
        if read.increment is not None:
            assert read.increment.interval == written.increment.interval
            np.testing.assert_allclose(read.increment.pose.matrix,
                                       written.increment.pose.matrix, atol=2e-9)
            np.testing.assert_allclose(read.increment.pose.covariance,
                                       written.increment.pose.covariance, rtol=1e-11)


def test_variances_are_beside_the_motion_for_spreadsheets(path, records):
    with open(path, newline='') as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0])[:6] == ['stamp', 'status', 'reason', 'keypoints', 'matches',
                                  'increment_interval']
    motion = records[1].increment.pose
    rotation = Rotation.from_matrix(motion.rotation).as_rotvec()
    for axis, (name, value) in enumerate(zip(('x', 'y', 'z', 'rot_x', 'rot_y', 'rot_z'),
                                             (*motion.translation, *rotation))):
        assert float(lines[1][f'increment_{name}']) == pytest.approx(value, abs=1e-9)
        for of, index, covariance_ in (('increment', 1, motion.covariance),
                                       ('pose', 1, records[1].pose.covariance),
                                       ('pose', 2, records[2].pose.covariance)):
            assert float(lines[index][f'{of}_variance_{name}']) == pytest.approx(
                covariance_[axis, axis], rel=1e-6)
    for line in (lines[0], lines[2]):
        assert {value for name, value in line.items() if name.startswith('increment')} == {''}
    assert (lines[1]['features_ms'], lines[2]['features_ms']) == ('1.250', '')


def test_frames_without_a_pose_are_left_out(path, records):
    found = read_frames(path, trajectory_of(records[1:]))
    assert [record.stamp for record in found] == [record.stamp for record in records[1:]]
    np.testing.assert_array_equal(found[0].T_odom_camera, records[1].T_odom_camera)


def test_the_largest_number_is_the_square_of_the_largest_distance(path, records):
    path.write_text(path.read_text().replace('4.500', '1e16'))
    assert read_frames(path, trajectory_of(records))[1].timing['total'] == 1e16


@pytest.mark.parametrize(('old', 'new', 'line'), [
    ('OK', 'FINE', 3), ('1.033333334', 'now', 3), ('300', 'many', 3), ('stamp', 'time', 2),
    ('increment_cov_xx', 'increment', 3), ('TOO_FEW_MATCHES', '', 4)])
def test_damaged_lines_are_named(path, records, old, new, line):
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=rf'frames\.csv, line {line}: it is not a frame'):
        read_frames(path, trajectory_of(records))


@pytest.mark.parametrize('number', ['nan', 'inf', '1e17', '1e308', '1e400', '-1e300'])
@pytest.mark.parametrize('column', ['total_ms', 'increment_x', 'increment_interval',
                                    'increment_cov_xy'])
def test_numbers_beyond_any_run_are_named(path, records, column, number):
    """Only a covariance may be infinite; sums of larger numbers would overflow."""
    with open(path, newline='') as file:
        lines = list(csv.DictReader(file))
    lines[1][column] = number
    with open(path, 'w', newline='') as file:
        table = csv.DictWriter(file, list(lines[0]))
        table.writeheader()
        table.writerows(lines)
    if 'cov' in column and number in ('nan', 'inf', '1e400'):
        assert len(read_frames(path, trajectory_of(records))) == 3
        return
    with pytest.raises(InputError, match=r'frames\.csv, line 3: it is not a frame'):
        read_frames(path, trajectory_of(records))


@pytest.mark.parametrize('end', [0, 300, -40])
def test_a_table_that_ends_early_is_damaged_or_shorter(path, records, end):
    path.write_bytes(path.read_bytes()[:end])
    try:
        assert len(read_frames(path, trajectory_of(records))) < len(records)
    except InputError:
        pass
