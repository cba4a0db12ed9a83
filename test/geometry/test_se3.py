# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SE(3) against closed forms, general solvers and numerical differentiation."""

import numpy as np
import pytest
from scipy.linalg import expm, logm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from aick_ros.geometry import point_fit, se3


def random_pose(rng, turn=1.0):
    return se3.exp(np.r_[rng.normal(0, 1, 3), rng.normal(0, turn, 3)])


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def fit_moments(source, target):
    """Fit as who has points has to."""
    source, target = (point_fit.homogeneous(np.asarray(points, float)) for points in (source, target))
    return point_fit.fit_moments(source.T @ target)


fits = pytest.mark.parametrize('fit', [point_fit.fit, fit_moments])


@fits
def test_fit_recovers_an_exact_motion(rng, fit):
    for _ in range(20):
        T, source = random_pose(rng), rng.normal(0, 1, (rng.integers(3, 40), 3))
        np.testing.assert_allclose(fit(source, se3.transform(T, source)), T, atol=1e-9)


@fits
def test_fit_is_the_least_squares_solution(rng, fit):
    T, source = random_pose(rng), rng.normal(0, 1, (30, 3))
    target = se3.transform(T, source) + rng.normal(0, 0.1, source.shape)

    def residuals(x):
        moved = source @ Rotation.from_rotvec(x[3:]).as_matrix().T + x[:3]
        return (moved - target).ravel()

    best = least_squares(residuals, np.r_[T[:3, 3], se3.log_rotation(T[:3, :3])])
    found = fit(source, target)
    moved = se3.transform(found, source)
    assert np.sum((moved - target) ** 2) == pytest.approx(2 * best.cost, rel=1e-6)


@fits
def test_fit_never_mirrors(rng, fit):
    """Points and their mirror image: the best proper rotation, not the reflection."""
    for _ in range(50):
        source = rng.normal(0, 1, (10, 3))
        T = fit(source, source * (-1, 1, 1))
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


@fits
def test_fit_of_coplanar_points(rng, fit):
    for noise in (0.0, 1e-3):
        source = np.c_[rng.normal(0, 1, (20, 2)), np.zeros(20)]
        T = random_pose(rng)
        found = fit(source, se3.transform(T, source) + rng.normal(0, noise, (20, 3)))
        assert np.linalg.det(found[:3, :3]) == pytest.approx(1.0)
        np.testing.assert_allclose(found, T, atol=1e-9 + 3 * noise)


@fits
@pytest.mark.parametrize('points', [
    np.zeros((0, 3)), np.zeros((2, 3)), np.full((10, 3), 1.7),
    np.outer(np.arange(10.0), (1, 2, 3)) + 5, [[0, 0, 0], [1, 1, 1], [2, 2, 2]]],
    ids=['none', 'two', 'one point', 'line', 'three on a line'])
def test_fit_refuses_what_leaves_a_turn_open(points, fit):
    for dtype in (np.float32, np.float64):
        points = np.asarray(points, dtype)
        with pytest.raises(point_fit.DegenerateGeometryError, match='point'):
            fit(points, points)


def test_exp_and_log_are_those_of_matrices(rng):
    for size in (1.0, 1e-3, 1e-6, 0.0):
        twist = size * rng.normal(0, 1, 6)
        matrix = np.zeros((4, 4))
        matrix[:3, :3], matrix[:3, 3] = se3.skew(twist[3:]), twist[:3]
        np.testing.assert_allclose(se3.exp(twist), expm(matrix), atol=1e-12)
        np.testing.assert_allclose(se3.log(se3.exp(twist)), twist, atol=1e-12)
    T = random_pose(rng)
    np.testing.assert_allclose(se3.log(T)[:3], logm(T).real[:3, 3], atol=1e-9)


def test_log_of_half_turns():
    for axis in np.eye(3):
        rotation = Rotation.from_rotvec(np.pi * axis).as_matrix()
        assert se3.angle(rotation) == pytest.approx(np.pi)
        np.testing.assert_allclose(se3.exp_rotation(se3.log_rotation(rotation)), rotation,
                                   atol=1e-9)


def test_quaternions_are_scipys(rng):
    for _ in range(100):
        rotation = Rotation.random(random_state=int(rng.integers(1 << 30)))
        expected = rotation.as_quat()
        expected *= 1 if expected[3] >= 0 else -1
        np.testing.assert_allclose(se3.to_quaternion(rotation.as_matrix()), expected,
                                   atol=1e-9)
        np.testing.assert_allclose(se3.from_quaternion(expected)[:3, :3],
                                   rotation.as_matrix(), atol=1e-9)


@pytest.mark.parametrize('quaternion', [(0, 0, 0, 0), (np.nan, 0, 0, 1), (np.inf, 0, 0, 0)])
def test_quaternion_that_is_no_rotation(quaternion):
    with pytest.raises(ValueError, match='no pose'):
        se3.from_quaternion(quaternion)


def test_roll_pitch_yaw_are_scipys(rng):
    for angles in rng.uniform(-3, 3, (20, 3)):
        T = se3.from_roll_pitch_yaw(*angles, translation=(1, 2, 3))
        np.testing.assert_allclose(T[:3, :3], Rotation.from_euler('xyz', angles).as_matrix(),
                                   atol=1e-12)
        assert T[:3, 3].tolist() == [1, 2, 3]


def test_interpolate(rng):
    start, end = random_pose(rng), random_pose(rng)
    np.testing.assert_allclose(se3.interpolate(start, end, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(se3.interpolate(start, end, 1.0), end, atol=1e-12)
    middle = se3.interpolate(start, end, 0.5)
    whole = se3.angle(start[:3, :3].T @ end[:3, :3])
    assert se3.angle(start[:3, :3].T @ middle[:3, :3]) == pytest.approx(whole / 2)
    np.testing.assert_allclose(middle[:3, 3], (start[:3, 3] + end[:3, 3]) / 2)


def test_perturbed_turns_about_the_fixed_axes_of_the_target(rng):
    pose, error = random_pose(rng), rng.normal(0, 0.5, 6)
    moved = se3.perturbed(pose, error)
    turn = Rotation.from_rotvec(error[3:]) * Rotation.from_matrix(pose[:3, :3])
    np.testing.assert_allclose(moved[:3, :3], turn.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(moved[:3, 3], pose[:3, 3] + error[:3], atol=1e-12)
    np.testing.assert_array_equal(se3.perturbed(pose, np.zeros(6)), pose)
    np.testing.assert_allclose(se3.difference(moved, pose), error, atol=1e-12)


def test_scaled_is_the_matrix_power(rng):
    motion = random_pose(rng, 0.5)
    np.testing.assert_array_equal(se3.scaled(motion, 1.0), motion)
    for share in (0.0, 0.3, 0.9, 1.2, 2.0):
        np.testing.assert_allclose(se3.scaled(motion, share),
                                   expm(share * logm(motion).real), atol=1e-9)


def error_between(T, moved):
    return np.r_[moved[:3, 3] - T[:3, 3], se3.log_rotation(moved[:3, :3] @ T[:3, :3].T)]


def numeric_jacobian(function, T):
    step = 1e-6
    return np.column_stack([
        error_between(function(T), function(se3.perturbed(T, step * axis))) / step
        for axis in np.eye(6)])


def test_compose_covariance_is_first_order_propagation(rng):
    pose, increment = random_pose(rng), random_pose(rng, 0.3)
    S, Q = (np.cov(rng.normal(0, 0.01, (6, 50))) for _ in range(2))
    F = numeric_jacobian(lambda T: T @ increment, pose)
    G = numeric_jacobian(lambda T: pose @ T, increment)
    np.testing.assert_allclose(se3.compose_covariance(pose, S, increment, Q),
                               F @ S @ F.T + G @ Q @ G.T, atol=1e-8)


def test_relative_covariance_is_first_order_propagation(rng):
    start, end = random_pose(rng), random_pose(rng)
    S, Q = (np.cov(rng.normal(0, 0.01, (6, 50))) for _ in range(2))
    F = numeric_jacobian(lambda T: np.linalg.inv(T) @ end, start)
    G = numeric_jacobian(lambda T: np.linalg.inv(start) @ T, end)
    np.testing.assert_allclose(se3.relative_covariance(start, S, end, Q),
                               F @ S @ F.T + G @ Q @ G.T, atol=1e-8)


def test_change_body_is_first_order_propagation(rng):
    increment, T_base_camera = random_pose(rng, 0.3), random_pose(rng)
    Q = np.cov(rng.normal(0, 0.01, (6, 50)))

    def of_base(T):
        return T_base_camera @ T @ np.linalg.inv(T_base_camera)

    J = numeric_jacobian(of_base, increment)
    moved, covariance = se3.change_body(increment, Q, T_base_camera)
    np.testing.assert_allclose(moved, of_base(increment), atol=1e-12)
    np.testing.assert_allclose(covariance, J @ Q @ J.T, atol=1e-8)
