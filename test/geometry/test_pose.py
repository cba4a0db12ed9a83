# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses with covariance against numerical differentiation, Monte Carlo and the laws of a group."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from aick_ros.errors import InputError
from aick_ros.geometry.pose import Increment, PoseWithCovariance, of_inverse, unknown_covariance

VECTORS = arrays(np.float64, 3, elements=st.floats(-3.0, 3.0))
MATRICES = st.builds(lambda turn, way: np.block([
    [Rotation.from_rotvec(turn).as_matrix(), way[:, None]], [np.zeros(3), 1.0]]), VECTORS, VECTORS)
POSES = st.builds(PoseWithCovariance, MATRICES, arrays(
    np.float64, (6, 6), elements=st.floats(-1.0, 1.0)).map(lambda root: root @ root.T))
"""Any pose; covariances may be zero or singular."""


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def random_matrix(rng):
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rng.normal(0, 1, 3)).as_matrix()
    matrix[:3, 3] = rng.normal(0, 1, 3)
    return matrix


def random_pose(rng, sigma=0.01):
    return PoseWithCovariance(random_matrix(rng), np.cov(rng.normal(0, sigma, (6, 50))))


def with_error(matrix, error):
    """Return a pose with an error by the model of geometry_msgs, with SciPy's rotations."""
    result = matrix.copy()
    result[:3, :3] = Rotation.from_rotvec(error[3:]).as_matrix() @ matrix[:3, :3]
    result[:3, 3] += error[:3]
    return result


def error_of(matrix, reference):
    rotation = Rotation.from_matrix(matrix[:3, :3] @ reference[:3, :3].T)
    return np.r_[matrix[:3, 3] - reference[:3, 3], rotation.as_rotvec()]


def propagated(function, *poses):
    """Return the first-order covariance of a function of poses, by central differences."""
    step, total = 1e-5, np.zeros((6, 6))
    matrices = [pose.matrix for pose in poses]
    reference = function(*matrices)
    for i, pose in enumerate(poses):
        def changed(error):
            return error_of(function(*matrices[:i], with_error(pose.matrix, error),
                                     *matrices[i + 1:]), reference)
        jacobian = np.column_stack([
            (changed(step * axis) - changed(-step * axis)) / (2 * step) for axis in np.eye(6)])
        total += jacobian @ pose.covariance @ jacobian.T
    return total


def assert_same(found, expected, atol=1e-12):
    np.testing.assert_allclose(found.matrix, expected.matrix, atol=atol)
    np.testing.assert_allclose(found.covariance, expected.covariance, atol=atol)


OPERATIONS = {
    'composition': (lambda a, b: a @ b, lambda a, b: a @ b),
    'inverse': (lambda a, b: a.inverse(), lambda a, b: np.linalg.inv(a)),
    'relative': (lambda a, b: a.relative_to(b), lambda a, b: np.linalg.inv(b) @ a)}


@pytest.mark.parametrize('operation', OPERATIONS)
def test_covariances_are_propagated_to_first_order(rng, operation):
    of_poses, of_matrices = OPERATIONS[operation]
    for _ in range(5):
        poses = random_pose(rng), random_pose(rng)
        found = of_poses(*poses)
        np.testing.assert_allclose(
            found.matrix, of_matrices(*(pose.matrix for pose in poses)), atol=1e-12)
        np.testing.assert_allclose(found.covariance, propagated(of_matrices, *poses), atol=1e-9)


@pytest.mark.parametrize('operation', OPERATIONS)
def test_covariances_are_those_of_sampled_errors(rng, operation):
    """Monte Carlo: scale and axes, as the ratio of the two covariances in any direction."""
    of_poses, of_matrices = OPERATIONS[operation]
    poses = random_pose(rng, 0.003), random_pose(rng, 0.003)
    reference = of_matrices(*(pose.matrix for pose in poses))
    drawn = zip(*(rng.multivariate_normal(np.zeros(6), pose.covariance, 4000) for pose in poses))
    errors = np.array([error_of(of_matrices(*(with_error(pose.matrix, error)
                                              for pose, error in zip(poses, pair))), reference)
                       for pair in drawn])
    root = np.linalg.cholesky(of_poses(*poses).covariance)
    whitened = np.cov(np.linalg.solve(root, errors.T))
    assert np.abs(np.linalg.eigvalsh(whitened) - 1).max() < 0.15


def test_the_motion_of_a_base_is_that_of_the_camera_fixed_to_it(rng):
    camera, T_base_camera = random_pose(rng), random_matrix(rng)

    def of_base(matrix):
        return T_base_camera @ matrix @ np.linalg.inv(T_base_camera)

    base = camera.in_body(T_base_camera)
    np.testing.assert_allclose(base.matrix, of_base(camera.matrix), atol=1e-12)
    np.testing.assert_allclose(base.covariance, propagated(of_base, camera), atol=1e-9)
    assert_same(base.in_body(np.linalg.inv(T_base_camera)), camera)


def test_a_rotating_camera_ahead_of_the_base_gives_the_base_its_lever_arm():
    """Written out: the camera is 1 m ahead and turns in place with an uncertain yaw."""
    T_base_camera = np.eye(4)
    T_base_camera[0, 3] = 1.0
    camera = PoseWithCovariance(np.eye(4), np.diag([0, 0, 0, 0, 0, 0.01]))
    expected = np.zeros((6, 6))
    expected[1, 1] = expected[5, 5] = 0.01  # a yaw about the camera swings the base sideways
    expected[1, 5] = expected[5, 1] = -0.01  # to the right if it is to the left
    np.testing.assert_allclose(camera.in_body(T_base_camera).covariance, expected, atol=1e-15)


def test_composition_is_associative_and_has_an_identity(rng):
    a, b, c = (random_pose(rng) for _ in range(3))
    assert_same((a @ b) @ c, a @ (b @ c))
    assert_same(a @ PoseWithCovariance.identity(), a)
    assert_same(PoseWithCovariance.identity() @ a, a)


def test_the_inverse_is_an_involution_and_reverses_products(rng):
    a, b = random_pose(rng), random_pose(rng)
    assert_same(a.inverse().inverse(), a)
    assert_same((a @ b).inverse(), b.inverse() @ a.inverse())
    np.testing.assert_allclose((a @ a.inverse()).matrix, np.eye(4), atol=1e-12)


def test_a_matrix_composes_as_an_exact_pose_from_either_side(rng):
    pose, matrix = random_pose(rng), random_matrix(rng)
    exact = PoseWithCovariance(matrix)
    assert not exact.covariance.any()
    for found, expected in ((matrix @ pose, exact @ pose), (pose @ matrix, pose @ exact)):
        assert isinstance(found, PoseWithCovariance)
        assert_same(found, expected)


def test_covariances_stay_symmetric_and_positive_over_many_steps(rng):
    pose = PoseWithCovariance.identity()
    for _ in range(200):
        pose = pose @ random_pose(rng, 1e-3)
    np.testing.assert_allclose(pose.covariance, pose.covariance.T, rtol=1e-9)
    assert np.linalg.eigvalsh(pose.covariance).min() > 0


def test_twist_over_the_interval_is_the_motion(rng):
    increment = Increment(random_pose(rng), 0.25)
    vx, vy, vz, wx, wy, wz = increment.twist
    generator = np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0]])
    np.testing.assert_allclose(expm(0.25 * generator), increment.pose.matrix, atol=1e-12)
    np.testing.assert_allclose(generator, logm(increment.pose.matrix).real / 0.25, atol=1e-9)


def test_the_increment_of_a_base_has_the_same_interval(rng):
    increment, T_base_camera = Increment(random_pose(rng), 0.25), random_matrix(rng)
    moved = increment.in_body(T_base_camera)
    assert moved.interval == 0.25
    assert_same(moved.pose, increment.pose.in_body(T_base_camera))


@settings(max_examples=30, deadline=None)
@given(POSES, POSES, MATRICES)
def test_laws_hold_for_any_poses(a, b, matrix):
    assert_same(a.inverse().inverse(), a, atol=1e-9)
    assert_same((a @ b).inverse(), b.inverse() @ a.inverse(), atol=1e-9)
    assert_same(a.relative_to(b), b.inverse() @ a, atol=1e-9)
    assert_same((a @ b).in_body(matrix), a.in_body(matrix) @ b.in_body(matrix), atol=1e-7)
    for pose in (a @ b, a.inverse(), a.in_body(matrix)):
        np.testing.assert_allclose(pose.covariance, pose.covariance.T, atol=1e-9)
        assert np.linalg.eigvalsh(pose.covariance).min() > -1e-9


@settings(max_examples=30, deadline=None)
@given(POSES, POSES, POSES)
def test_what_was_added_along_a_path_is_the_motion_since(start, first, second):
    assert_same((start @ first).since(start), first, atol=1e-7)
    assert_same((start @ first @ second).since(start), first @ second, atol=1e-7)


@given(MATRICES, MATRICES, st.floats(1e-3, 10.0))
def test_the_twist_of_a_base_moves_it_as_the_camera(motion, T_base_camera, interval):
    """The motion of the twist, by the matrix exponential, for any motion but a half turn."""
    if np.linalg.norm(Rotation.from_matrix(motion[:3, :3]).as_rotvec()) > 3.0:
        return
    increment = Increment(PoseWithCovariance(motion), interval).in_body(T_base_camera)
    vx, vy, vz, wx, wy, wz = interval * increment.twist
    generator = np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0]])
    np.testing.assert_allclose(expm(generator) @ T_base_camera, T_base_camera @ motion, atol=1e-9)


@pytest.mark.parametrize('interval', [0.0, -0.1, np.inf, np.nan, 'a second'])
def test_an_increment_takes_some_time(interval):
    Increment(PoseWithCovariance.identity(), 1e-9)
    is_number = interval not in ('a second', None) and not np.isnan(interval)
    sentence = (f'the interval of an increment is {interval}: a positive number of seconds is '
                'required' if is_number else 'the interval of an increment: .* a number is')
    with pytest.raises(InputError, match=sentence):
        Increment(PoseWithCovariance.identity(), interval)


def test_without_information_every_variance_is_infinite_and_nothing_correlates():
    covariance = unknown_covariance()
    assert covariance.shape == (6, 6)
    assert np.isinf(np.diag(covariance)).all() and (np.diag(covariance) > 0).all()
    assert not covariance[~np.eye(6, dtype=bool)].any()


def test_since_a_start_without_covariance_the_later_one_is_all_that_was_added(rng):
    start, later = PoseWithCovariance(random_matrix(rng)), random_pose(rng)
    assert_same(later.since(start), start.inverse() @ later)
    assert_same(later.since(start.matrix), start.inverse() @ later)


def test_where_less_is_known_of_the_start_than_of_the_end_nothing_was_added(rng):
    """Variances are never negative, whatever the covariances are."""
    start = random_pose(rng, 0.1)
    later = PoseWithCovariance(start.matrix @ random_matrix(rng))
    np.testing.assert_allclose(later.since(start).covariance, 0.0, atol=1e-12)


def test_rotation_and_translation_are_parts_of_the_matrix(rng):
    pose = random_pose(rng)
    np.testing.assert_array_equal(np.c_[pose.rotation, pose.translation], pose.matrix[:3])


def test_an_error_of_a_pose_is_one_of_its_inverse(rng):
    matrix, error = random_matrix(rng), rng.normal(0, 1e-6, 6)
    inverse = np.linalg.inv(matrix)
    np.testing.assert_allclose(
        with_error(inverse, of_inverse(matrix) @ error),
        np.linalg.inv(with_error(matrix, error)), atol=1e-10)
