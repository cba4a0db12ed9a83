# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Trajectories: interpolation against SciPy, and the TUM format."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.geometry.trajectory import (
    Trajectory, read_trajectory, seconds_to_stamp, stamp_to_seconds, write_trajectory)

SECOND = 1_000_000_000


def path_of(count, seed=0):
    rng = np.random.default_rng(seed)
    stamps = 1305031102_175304000 + np.arange(count) * 33_333_333
    return Trajectory(stamps, np.array([se3.exp(rng.normal(0, 1, 6)) for _ in range(count)]))


def test_interpolation_is_linear_in_position_and_slerp_in_rotation():
    path = path_of(6)
    slerp = Slerp(path.stamps - path.stamps[0],
                  Rotation.from_matrix(path.poses[:, :3, :3]))
    for stamp in path.stamps[:-1] + 12_345_678:
        pose = path.at(int(stamp))
        np.testing.assert_allclose(pose[:3, :3], slerp(stamp - path.stamps[0]).as_matrix(),
                                   atol=1e-6)
        expected = [np.interp(stamp - path.stamps[0], path.stamps - path.stamps[0], axis)
                    for axis in path.poses[:, :3, 3].T]
        np.testing.assert_allclose(pose[:3, 3], expected)


def test_at_a_stamp_of_the_trajectory_its_pose_is_returned():
    path = path_of(3)
    for stamp, pose in zip(path.stamps, path.poses):
        np.testing.assert_array_equal(path.at(int(stamp)), pose)


def test_outside_and_in_a_long_gap_there_is_no_pose():
    path = path_of(3)
    assert path.at(int(path.stamps[0]) - 1) is None
    assert path.at(int(path.stamps[-1]) + 1) is None
    assert path.at(int(path.stamps[0]) + 1, max_gap=0.03) is None
    assert path.at(int(path.stamps[0]) + 1, max_gap=0.04) is not None


def test_a_gap_as_long_as_the_longest_is_interpolated():
    path = Trajectory(np.array([0, SECOND // 4]), np.tile(np.eye(4), (2, 1, 1)))
    assert path.at(1, max_gap=0.25) is not None
    assert path.at(1, max_gap=0.249999999) is None


@pytest.mark.parametrize('text, stamp', [
    ('1305031102.175304', 1305031102_175304000), ('1.5', 1_500_000_000), ('7', 7 * SECOND),
    ('0.000000001', 1), ('1305031102.123456789', 1305031102_123456789), ('1e2', 100 * SECOND),
    ('13e-5', 130_000)])
def test_stamps_are_exact_to_the_nanosecond(text, stamp):
    assert seconds_to_stamp(text) == stamp


def test_stamps_end_where_those_of_ros_end():
    assert seconds_to_stamp('2147483647.999999999') == MAX_STAMP == 2 ** 31 * SECOND - 1
    for text in ('2147483648', '-0.000000001', '9223372036.86', '1e200', '1e300', '-1e10', 'inf',
                 'nan', '9' * 5000, '\u00b2'):
        with pytest.raises(ValueError):
            seconds_to_stamp(text)


def test_stamps_have_nine_decimals():
    assert stamp_to_seconds(1305031102_000000007) == '1305031102.000000007'
    assert stamp_to_seconds(-1) == '-0.000000001'


def test_file_round_trip(tmp_path):
    path = path_of(20)
    write_trajectory(tmp_path / 'path.tum', path)
    again = read_trajectory(tmp_path / 'path.tum')
    np.testing.assert_array_equal(again.stamps, path.stamps)
    np.testing.assert_allclose(again.poses, path.poses, atol=1e-8)


@pytest.mark.parametrize('text, sentence', [
    ('1.0 1 2 3 0 0 0\n', r"line 1: '1\.0 1 2 3 0 0 0' is not a pose"),
    ('# a comment\n1.0 0 0 0 0 0 0 1\n2.0 a b c 0 0 0 1\n', 'line 3'),
    ('1.0 0 0 0 0 0 0 0\n', 'line 1'), ('inf 0 0 0 0 0 0 1\n', 'line 1'),
    ('1e30 0 0 0 0 0 0 1\n', 'line 1'), ('1e200 0 0 0 0 0 0 1\n', 'line 1'),
    ('-1 0 0 0 0 0 0 1\n', 'line 1'), ('2147483648 0 0 0 0 0 0 1\n', 'line 1'),
    ('1 1e150 0 0 0 0 0 1\n', 'line 1'), ('1 0 0 0 nan 0 0 1\n', 'line 1'),
    ('1 0 0 2e8 0 0 0 1\n', 'line 1'), ('1 0 0 nan 0 0 0 1\n', 'line 1'),
    ('# nothing\n', 'has no poses'), ('', 'has no poses')])
def test_invalid_files_are_rejected_with_the_line(tmp_path, text, sentence):
    file = tmp_path / 'groundtruth.txt'
    file.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_trajectory(file)


def test_a_missing_file_is_reported_with_its_name(tmp_path):
    with pytest.raises(InputError, match='nowhere.txt'):
        read_trajectory(tmp_path / 'nowhere.txt')


def test_poses_are_sorted_and_of_a_stamp_that_repeats_the_first_counts(tmp_path):
    file = tmp_path / 'path.tum'
    file.write_text(''.join(f'{stamp} {x} 0 0 0 0 0 1\n' for stamp, x in (
        (3, 30), (1, 10), (3, 31), (2, 20), (1, 11))))
    found = read_trajectory(file)
    assert (found.stamps // SECOND).tolist() == [1, 2, 3]
    assert found.poses[:, 0, 3].tolist() == [10, 20, 30]
