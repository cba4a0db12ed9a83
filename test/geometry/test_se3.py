# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SE(3) against matrix functions and SciPy, and numerical differentiation."""

from contextlib import nullcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm, logm, sqrtm
from scipy.spatial.transform import Rotation

from aick_ros.borders.limits import MAX_DISTANCE
from aick_ros.errors import InputError
from aick_ros.geometry import se3

POSES = arrays(np.float64, 6, elements=st.floats(-100.0, 100.0)).map(se3.exp)
NUMBERS = st.floats() | st.sampled_from([1e300, 1e-300, 1e150, MAX_DISTANCE])


UP = np.array([0.0, 0.0, 1.0])


def random_pose(rng, angle=1.0):
    return se3.exp(np.r_[rng.normal(0, 1, 3), rng.normal(0, angle, 3)])


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def test_exp_and_log_are_the_matrix_functions(rng):
    for size in (1.0, 1e-3, 1e-6, 0.0):
        twist = size * rng.normal(0, 1, 6)
        matrix = np.zeros((4, 4))
        matrix[:3, :3], matrix[:3, 3] = se3.skew(twist[3:]), twist[:3]
        np.testing.assert_allclose(se3.exp(twist), expm(matrix), atol=1e-12)
        np.testing.assert_allclose(se3.log(se3.exp(twist)), twist, atol=1e-12)
    T = random_pose(rng)
    np.testing.assert_allclose(se3.log(T)[:3], logm(T).real[:3, 3], atol=1e-9)


@pytest.mark.parametrize('angle', [0.0, 1e-6, 9.9e-5, 1.01e-4, 1e-3])
def test_the_series_of_small_angles_is_exact(rng, angle):
    """With a translation of metres, that of a small rotation is right to the last digits."""
    axis = rng.normal(0, 1, 3)
    twist = np.array([3.0, -2.0, 4.0, *(angle * axis / np.linalg.norm(axis))])
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = se3.skew(twist[3:]), twist[:3]
    np.testing.assert_allclose(se3.exp(twist), expm(matrix), rtol=0, atol=1e-14)
    np.testing.assert_allclose(se3.log(expm(matrix)), twist, rtol=0, atol=1e-14)


def test_log_of_rotations_by_pi():
    for axis in np.eye(3):
        rotation = Rotation.from_rotvec(np.pi * axis).as_matrix()
        assert se3.angle(rotation) == pytest.approx(np.pi)
        np.testing.assert_allclose(se3.exp_rotation(se3.log_rotation(rotation)), rotation,
                                   atol=1e-9)


def test_quaternions_agree_with_scipy(rng):
    for _ in range(100):
        rotation = Rotation.random(random_state=int(rng.integers(1 << 30)))
        expected = rotation.as_quat()
        expected *= 1 if expected[3] >= 0 else -1
        np.testing.assert_allclose(se3.to_quaternion(rotation.as_matrix()), expected,
                                   atol=1e-9)
        np.testing.assert_allclose(se3.from_quaternion(expected)[:3, :3],
                                   rotation.as_matrix(), atol=1e-9)


@pytest.mark.parametrize('quaternion', [(0, 0, 0, 0), (np.nan, 0, 0, 1), (np.inf, 0, 0, 0)])
def test_an_invalid_quaternion_is_rejected(quaternion):
    with pytest.raises(ValueError, match='not a pose'):
        se3.from_quaternion(quaternion)


def test_roll_pitch_yaw_agrees_with_scipy(rng):
    for angles in rng.uniform(-3, 3, (20, 3)):
        T = se3.from_roll_pitch_yaw(*angles, translation=(1, 2, 3))
        np.testing.assert_allclose(T[:3, :3], Rotation.from_euler('xyz', angles).as_matrix(),
                                   atol=1e-12)
        assert T[:3, 3].tolist() == [1, 2, 3]
        assert se3.from_roll_pitch_yaw(*angles)[:3, 3].tolist() == [0, 0, 0]


def test_interpolation_is_linear_in_position_and_angle(rng):
    start, end = random_pose(rng), random_pose(rng)
    np.testing.assert_allclose(se3.interpolate(start, end, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(se3.interpolate(start, end, 1.0), end, atol=1e-12)
    middle = se3.interpolate(start, end, 0.5)
    angle = se3.angle(start[:3, :3].T @ end[:3, :3])
    assert se3.angle(start[:3, :3].T @ middle[:3, :3]) == pytest.approx(angle / 2)
    np.testing.assert_allclose(middle[:3, 3], (start[:3, 3] + end[:3, 3]) / 2)


def test_an_error_rotates_about_the_fixed_axes_of_the_target(rng):
    pose, error = random_pose(rng), rng.normal(0, 0.5, 6)
    moved = se3.perturbed(pose, error)
    rotation = Rotation.from_rotvec(error[3:]) * Rotation.from_matrix(pose[:3, :3])
    np.testing.assert_allclose(moved[:3, :3], rotation.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(moved[:3, 3], pose[:3, 3] + error[:3], atol=1e-12)
    np.testing.assert_allclose(se3.perturbed(pose, np.zeros(6)), pose, atol=1e-15)
    np.testing.assert_allclose(se3.difference(moved, pose), error, atol=1e-12)


def test_point_jacobian_is_the_numeric_derivative(rng):
    pose, points, step = random_pose(rng), rng.normal(0, 1, (5, 3)), 1e-6
    numeric = np.stack([
        (se3.transform(se3.perturbed(pose, step * axis), points)
         - se3.transform(se3.perturbed(pose, -step * axis), points)) / (2 * step)
        for axis in np.eye(6)], axis=-1)
    np.testing.assert_allclose(se3.point_jacobian(points @ pose[:3, :3].T), numeric, atol=1e-8)


@pytest.mark.parametrize('count', [0, 1, 2, 5, 33])
@pytest.mark.parametrize('kind, error', [(np.float64, 1e-12), (np.float32, 1e-6)])
def test_transform_keeps_the_type_of_the_points(rng, count, kind, error):
    pose, points = random_pose(rng), rng.normal(0, 1, (2 * count, 3)).astype(kind)[::2]
    expected = np.c_[points, np.ones(count)] @ pose.T
    moved = se3.transform(pose, points)
    np.testing.assert_allclose(moved, expected[:, :3], atol=error)
    assert moved.dtype == kind


def test_points_have_three_coordinates_each():
    with pytest.raises(ValueError, match='the points has 8 numbers: 12 are required'):
        se3.transform(np.eye(4), np.ones((4, 2)))
    with pytest.raises(ValueError, match='the pose has 9 numbers: 16 are required'):
        se3.transform(np.eye(3), np.ones((4, 3)))


@given(POSES, POSES, POSES)
def test_poses_are_a_group(a, b, c):
    np.testing.assert_allclose(a @ se3.inverse(a), np.eye(4), atol=1e-10)
    np.testing.assert_allclose(se3.inverse(a @ b), se3.inverse(b) @ se3.inverse(a), atol=1e-9)
    np.testing.assert_allclose(se3.checked(a @ b @ c, 'it'), a @ (b @ c), atol=1e-9)


@given(POSES)
def test_exp_log_and_quaternions_are_inverse(pose):
    np.testing.assert_allclose(se3.exp(se3.log(pose)), pose, atol=1e-6)
    again = se3.from_quaternion(se3.to_quaternion(pose[:3, :3]), pose[:3, 3])
    np.testing.assert_allclose(again, pose, atol=1e-9)


@given(POSES, POSES, st.floats(0.0, 1.0))
def test_interpolated_poses_are_poses_on_the_way(a, b, fraction):
    between = se3.checked(se3.interpolate(a, b, fraction), 'it')
    whole, part = (se3.angle(a[:3, :3].T @ pose[:3, :3]) for pose in (b, between))
    assert part == pytest.approx(fraction * whole, abs=1e-6)


@given(POSES, arrays(np.float64, 6, elements=st.floats(-1.0, 1.0)))
def test_difference_is_the_inverse_of_perturbed(pose, error):
    np.testing.assert_allclose(se3.difference(se3.perturbed(pose, error), pose), error, atol=1e-9)


def test_a_difference_is_along_and_about_the_axes_of_the_target(rng):
    pose, reference = random_pose(rng), random_pose(rng)
    turn = Rotation.from_matrix(pose[:3, :3]) * Rotation.from_matrix(reference[:3, :3]).inv()
    expected = np.r_[pose[:3, 3] - reference[:3, 3], turn.as_rotvec()]
    np.testing.assert_allclose(se3.difference(pose, reference), expected, atol=1e-12)
    np.testing.assert_allclose(se3.difference(pose.T.copy().T, reference), expected, atol=1e-12)
    assert not se3.difference(np.eye(4), np.eye(4)).any()


def test_matrices_that_are_no_poses_have_no_difference():
    for pose, reference in ((np.eye(3), np.eye(4)), (np.eye(4), np.eye(4)[:3])):
        with pytest.raises(ValueError, match='16 are required'):
            se3.difference(pose, reference)


@given(st.tuples(*[NUMBERS] * 4), st.tuples(*[NUMBERS] * 3))
def test_any_quaternion_and_translation_are_a_pose_or_rejected(quaternion, translation):
    try:
        pose = se3.from_quaternion(quaternion, translation)
    except ValueError:
        return
    np.testing.assert_array_equal(se3.checked(pose, 'it'), pose)


@pytest.mark.parametrize('pose', [
    None, 'pose', [[1, 2], [3]], 1j * np.eye(4), [[10 ** 400] * 4] * 4, np.eye(3),
    np.zeros((4, 4)), np.full((4, 4), np.nan),
    np.diag([1.0, 1.0, -1.0, 1.0]), np.diag([2.0, 2.0, 2.0, 1.0]),
    np.diag([1.001, 1.001, 1.001, 1.0]), np.diag([1, 1, 1, 2.0]),
    np.diag([1e300, 1e300, 1e300, 1.0]), np.eye(4) + [[0, 0, 0, 1e300]] * 4,
    np.eye(4) + [[0.0, 0.0, 0.0, 2 * MAX_DISTANCE], *[[0.0] * 4] * 3]])
def test_what_is_not_a_pose_is_rejected(pose):
    with pytest.raises(InputError, match='the pose is not a pose: '):
        se3.checked(pose, 'the pose')


@pytest.mark.parametrize('seed', range(5))
def test_the_rotation_between_two_directions_is_the_least_one(seed):
    one, other = (v / np.linalg.norm(v) for v in np.random.default_rng(seed).normal(size=(2, 3)))
    rotation = se3.rotation_between(one, other)
    assert np.allclose(se3.exp_rotation(rotation) @ one, other)
    assert np.linalg.norm(rotation) == pytest.approx(np.arccos(one @ other))


def test_equal_and_opposite_directions_have_a_rotation_too():
    assert se3.rotation_between(UP, UP).tolist() == [0, 0, 0]
    assert np.allclose(se3.exp_rotation(se3.rotation_between(UP, -UP)) @ UP, -UP)


def test_a_chain_of_expected_motions_stays_rigid():
    """Each pose is that expected of the two before it, and a small error."""
    rng = np.random.default_rng(4)
    before, now = np.eye(4), se3.exp((0.01, 0.0, 0.02, 0.03, -0.02, 0.01))
    for _ in range(1000):
        expected = now @ se3.inverse(before) @ now
        before, now = now, se3.perturbed(expected, rng.normal(0.0, 1e-4, 6))
    np.testing.assert_allclose(now[:3, :3] @ now[:3, :3].T, np.eye(3), atol=1e-14)


@pytest.mark.parametrize('sign', [1, -1])
@pytest.mark.parametrize('row, column', [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
def test_each_product_of_two_rows_may_be_off_by_a_ten_thousandth(rng, row, column, sign):
    """(S R)(S R)^T = S^2 for a rotation R and a symmetric S."""
    for error, is_rigid in ((0.99e-4, True), (1.01e-4, False)):
        square, matrix = np.eye(3), random_pose(rng)
        square[row, column] = square[column, row] = float(row == column) + sign * error
        matrix[:3, :3] = sqrtm(square).real @ matrix[:3, :3]
        assert se3.is_rigid(matrix) is is_rigid


@pytest.mark.parametrize('row, column, value, is_rigid', [
    *((row, 3, sign * value, is_rigid) for row in range(3) for sign in (1, -1)
      for value, is_rigid in ((1e100, True), (1.1e100, False))),
    *((row, 3, value, False) for row in range(3) for value in (np.nan, np.inf)),
    *((row, column, np.nan, False) for row in range(3) for column in range(3)),
    *((3, column, 1e-9, False) for column in range(3)), (3, 3, 1.0 + 1e-9, False)])
def test_each_number_counts_whether_a_matrix_is_rigid(row, column, value, is_rigid):
    matrix = np.eye(4)
    matrix[row, column] = value
    assert se3.is_rigid(matrix) is is_rigid


@pytest.mark.parametrize('axis', range(3))
def test_a_mirror_image_is_not_rigid(rng, axis):
    matrix = random_pose(rng)
    matrix[:3, axis] *= -1
    assert not se3.is_rigid(matrix)


@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize('sign', [1, -1])
def test_the_largest_distance_is_within(axis, sign):
    """Of a pose by its numbers along each axis, of a quaternion's by its length."""
    for distance, is_within in ((MAX_DISTANCE, True), (np.nextafter(MAX_DISTANCE, np.inf), False)):
        matrix, translation = np.eye(4), np.zeros(3)
        matrix[axis, 3] = translation[axis] = sign * distance
        with nullcontext() if is_within else pytest.raises(InputError, match='at most 1e.08 m'):
            np.testing.assert_array_equal(se3.checked(matrix, 'it'), matrix)
        with nullcontext() if is_within else pytest.raises(ValueError, match='is not a pose'):
            np.testing.assert_array_equal(se3.from_quaternion((0, 0, 0, 1), translation), matrix)


@pytest.mark.parametrize('length, is_pose', [(1e-9, True), (0.9e-9, False), (1e150, True)])
def test_quaternions_of_any_length_but_none_are_rotations(length, is_pose):
    with nullcontext() if is_pose else pytest.raises(ValueError, match='is not a pose'):
        pose = se3.from_quaternion((0.0, 0.0, length, 0.0), (1.0, 2.0, 3.0))
        assert pose.tolist() == [[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]


def test_the_sentence_about_a_quaternion_has_its_numbers_in_order():
    with pytest.raises(ValueError) as raised:
        se3.from_quaternion((0.5, 1.5, 2.5, np.nan), (3.5, 4.5, 5.5))
    assert str(raised.value) == (
        'quaternion 0.5 1.5 2.5 nan with translation 3.5, 4.5, 5.5 is not a pose')


@pytest.mark.parametrize('farthest, limit', [
    (3e8, ': it is 3e+08 m away, at most 1e+08 m are possible'), (np.inf, ''), (np.nan, '')])
def test_a_pose_that_is_too_far_away_is_one_with_the_limit(farthest, limit):
    with pytest.raises(ValueError) as raised:
        se3.from_quaternion((0, 0, 0, 1), (0, farthest, 0))
    assert str(raised.value).endswith(f' is not a pose{limit}')


@pytest.mark.parametrize('angle', [1e-8, 1e-5, 3.14])
def test_the_rotation_between_directions_that_are_nearly_equal_or_opposite(angle):
    other = np.array([0.0, np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(se3.rotation_between(UP, other), [-angle, 0.0, 0.0], rtol=1e-6)


def test_a_pose_that_was_checked_is_a_copy_of_float64():
    given = np.eye(4, dtype=np.float32)
    for pose in (given, np.eye(4)):
        found = se3.checked(pose, 'it')
        assert found.dtype == np.float64 and not np.shares_memory(found, pose)


@pytest.mark.parametrize('matrix, sentence', [
    (np.eye(3), 'the guess is not a pose: a 4x4 matrix is required'),
    (np.diag([1.0, 1.0, np.nan, 1.0]), 'the guess is not a pose: its numbers must be finite, the '
     'translation at most 1e+08 m'),
    (np.diag([1.0, 1.0, -1.0, 1.0]), 'the guess is not a pose: a rotation matrix, a translation '
     'and the last row 0 0 0 1 are required')])
def test_the_sentence_says_what_a_pose_requires(matrix, sentence):
    with pytest.raises(InputError) as raised:
        se3.checked(matrix, 'the guess')
    assert str(raised.value) == sentence


def test_a_checked_pose_is_a_copy():
    given = np.eye(4)
    found = se3.checked(given, 'the guess')
    given[0, 3] = 5.0
    assert found[0, 3] == 0.0
