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
    Trajectory, format_pose, read_trajectory, seconds_to_stamp, stamp_to_seconds, trajectory_text,
    write_trajectory)

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
    ('1.0 1 2 3 0 0 0\n', r"line 1: '1\.0 1 2 3 0 0 0' is not a pose; a line must have "
     r'stamp tx ty tz qx qy qz qw, the stamp from 0 to 2147483647\.999999999 s$'),
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
    with pytest.raises(InputError, match='cannot read the trajectory .*nowhere.txt'):
        read_trajectory(tmp_path / 'nowhere.txt')


def test_lines_in_any_order_are_sorted_and_of_a_repeated_stamp_the_first_counts(tmp_path):
    file = tmp_path / 'path.txt'
    file.write_text('# t\n  # u\n2.5 4 0 0 0 0 0 1\n1.5, 1, 2, 3, 0, 0, 0, 1\n\n'
                    '2.5 9 9 9 0 0 0 1\n0.5 7 0 0 0 0 1 0 and more\n')
    path = read_trajectory(file)
    assert path.stamps.tolist() == [500_000_000, 1_500_000_000, 2_500_000_000]
    assert path.poses[:, :3, 3].tolist() == [[7, 0, 0], [1, 2, 3], [4, 0, 0]]
    assert path.poses[0, :3, :3].tolist() == [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]


def test_a_line_is_stamp_position_and_quaternion():
    """A quarter turn about z; what is read by the tools of the benchmark."""
    half = np.sqrt(0.5)
    pose = se3.from_quaternion((0, 0, half, half), (1, -2, 3.25))
    assert format_pose(1_500_000_000, pose) == (
        '1.500000000 1.000000000 -2.000000000 3.250000000 0.000000000 0.000000000 '
        '0.707106781 0.707106781')
    text = trajectory_text(Trajectory(np.array([1_500_000_000]), pose[None]))
    assert text == f'# stamp tx ty tz qx qy qz qw\n{format_pose(1_500_000_000, pose)}\n'


def test_digits_beyond_nanoseconds_are_cut_and_spaces_are_no_digits():
    assert seconds_to_stamp(' 1.1234567899 ') == 1_123_456_789
    assert seconds_to_stamp('1.') == SECOND
    assert seconds_to_stamp('0') == 0
    assert seconds_to_stamp('.5') == SECOND // 2


@pytest.mark.parametrize('stamps', [[1, 1], [1, 3, 2]])
def test_stamps_increase_strictly(stamps):
    with pytest.raises(InputError, match='^the stamps of a trajectory do not increase: sort them, '
                                         'each once$'):
        Trajectory(np.array(stamps), np.tile(np.eye(4), (len(stamps), 1, 1)))


def test_the_pose_returned_may_be_changed():
    path = path_of(3)
    path.at(int(path.stamps[1]))[:] = 0.0
    assert path.poses[1, 3, 3] == 1.0
