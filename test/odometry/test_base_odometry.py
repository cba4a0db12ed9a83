# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The base follows the camera: against the conjugated chain, increments, and sampled errors."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.base_odometry import BasePose, Mount

T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.3, -0.2, 0.5))
CORRECTED = T_BASE_CAMERA @ se3.exp([0.05, 0.02, -0.03, 0.1, -0.2, 0.05])
ORIGIN, CERTAIN = np.eye(4), np.zeros((6, 6))


@pytest.fixture
def way():
    """Increments of a camera with their covariances, and the chain of both."""
    rng = np.random.default_rng(3)
    T, S, way = np.eye(4), np.zeros((6, 6)), [(np.eye(4), np.zeros((6, 6)), None, None)]
    for _ in range(20):
        increment = se3.exp(0.1 * rng.standard_normal(6))
        root = 0.01 * rng.standard_normal((6, 6))
        S = se3.compose_covariance(T, S, increment, root @ root.T)
        T = T @ increment
        way.append((T, S, increment, root @ root.T))
    return way


def accumulate(steps, T_base_camera, T, S):
    """The same by the formula of increments: d in the base frame, S' = F S F' + G Q G'."""
    for _, _, increment, covariance in steps:
        moved, Q = se3.change_body(increment, covariance, T_base_camera)
        S = se3.compose_covariance(T, S, moved, Q)
        T = T @ moved
    return T, S


def test_with_a_fixed_camera_it_is_the_chain_seen_from_the_base(way):
    base = BasePose(ORIGIN, CERTAIN)
    for T, S, *_ in way:
        found, covariance = base.follow(T, S, T_BASE_CAMERA)
        expected, expected_covariance = se3.change_body(T, S, T_BASE_CAMERA)
        np.testing.assert_allclose(found, expected, atol=1e-12)
        np.testing.assert_allclose(covariance, expected_covariance, atol=1e-12)


def test_a_corrected_extrinsic_does_not_move_the_base(way):
    """From then on the increments are those seen with the new one."""
    base = BasePose(ORIGIN, CERTAIN)
    for T, S, *_ in way[:11]:
        before = base.follow(T, S, T_BASE_CAMERA)
    again = base.follow(*way[10][:2], CORRECTED)
    np.testing.assert_allclose(again[0], before[0], atol=1e-12)
    np.testing.assert_allclose(again[1], before[1], atol=1e-12)
    for T, S, *_ in way[11:]:
        found = base.follow(T, S, CORRECTED)
    expected = accumulate(way[11:], CORRECTED, *accumulate(
        way[1:11], T_BASE_CAMERA, ORIGIN, CERTAIN))
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


def test_a_camera_that_moves_on_the_base_does_not_move_the_base():
    """The camera pans and sways on a base that drives: of both only the driving is seen."""
    told, start = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), se3.exp([0, 0, 0, 0, 0, 0.05])
    base, T_base, T_told_base = BasePose(ORIGIN, CERTAIN), np.eye(4), np.eye(4)
    for i in range(10):
        sway = se3.exp([0.01 * i, 0.0, 0.02 * i, 0.0, 0.1 * i, 0.0])
        T_base_camera = T_BASE_CAMERA @ sway @ start
        T_visual_camera = se3.inverse(T_BASE_CAMERA @ start) @ T_base @ T_base_camera
        found, _ = base.follow(T_visual_camera, CERTAIN, T_base_camera, Mount.MOVING)
        np.testing.assert_allclose(found, T_told_base @ T_base, atol=1e-9)
        if i == 4:  # it is put elsewhere while the camera moves
            base.put(told, CERTAIN)
            T_told_base = told @ se3.inverse(T_base)
        T_base = T_base @ se3.exp([0.1, 0.02, 0.0, 0.0, 0.0, 0.1])


def test_put_somewhere_it_goes_on_from_there_as_sure_as_it_was_told(way):
    told, sure = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), np.diag([1, 2, 3, 4, 5, 6.0])
    base = BasePose(ORIGIN, CERTAIN)
    for T, S, *_ in way[:6]:
        base.follow(T, S, T_BASE_CAMERA)
    base.put(told, sure)
    np.testing.assert_array_equal(base.T_odom_base, told)
    for T, S, *_ in way[6:]:
        found = base.follow(T, S, T_BASE_CAMERA)
    expected = accumulate(way[6:], T_BASE_CAMERA, told, sure)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


def test_it_starts_where_it_is_told(way):
    told = se3.exp([4, -2, 1, 0.3, 0.2, 1.5])
    base = BasePose(told, CERTAIN)
    np.testing.assert_allclose(base.follow(*way[0][:2], T_BASE_CAMERA)[0], told, atol=1e-12)
    found, _ = base.follow(*way[9][:2], T_BASE_CAMERA)
    expected, _ = accumulate(way[1:10], T_BASE_CAMERA, told, CERTAIN)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_when_the_camera_begins_anew_the_base_stays(way):
    base = BasePose(ORIGIN, CERTAIN)
    for T, S, *_ in way:
        before = base.follow(T, S, T_BASE_CAMERA)
    base.restart()
    after = base.follow(ORIGIN, CERTAIN, T_BASE_CAMERA)
    np.testing.assert_allclose(after[0], before[0], atol=1e-12)
    np.testing.assert_allclose(after[1], before[1], atol=1e-12)


def test_put_somewhere_unseen_it_stays_there_until_the_next_pose_of_the_camera(way):
    told, sure = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), np.diag([1, 2, 3, 4, 5, 6.0])
    base = BasePose(ORIGIN, CERTAIN)
    for T, S, *_ in way[:6]:
        base.follow(T, S, T_BASE_CAMERA)
    base.put(told, sure)
    base.restart()
    for T, S, *_ in way[12:]:
        found = base.follow(T, S, CORRECTED)
    expected = accumulate(way[13:], CORRECTED, told, sure)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


def test_the_covariance_is_that_of_sampled_errors():
    """Monte Carlo: camera poses with drawn errors, each carried to the base by itself."""
    rng = np.random.default_rng(8)
    told = se3.exp([1, 2, 3, 0.4, -0.3, 0.8])
    root = np.diag([0.02, 0.01, 0.03, 0.02, 0.03, 0.01]) @ (
        np.eye(6) + 0.3 * rng.standard_normal((6, 6)))
    T_camera = se3.exp([0.5, -1.0, 2.0, 0.5, 0.3, -0.6])
    base = BasePose(told, CERTAIN)
    base.follow(ORIGIN, CERTAIN, T_BASE_CAMERA)
    T_base, covariance = base.follow(T_camera, root @ root.T, T_BASE_CAMERA)
    errors = []
    for delta in 0.1 * rng.standard_normal((20000, 6)) @ root.T:
        true = np.array(T_camera)
        true[:3, :3] = se3.exp_rotation(delta[3:]) @ T_camera[:3, :3]
        true[:3, 3] += delta[:3]
        moved = told @ T_BASE_CAMERA @ true @ se3.inverse(T_BASE_CAMERA)
        errors.append(np.concatenate([
            moved[:3, 3] - T_base[:3, 3],
            se3.log_rotation(moved[:3, :3] @ T_base[:3, :3].T)]))
    sampled = np.cov(np.array(errors).T) / 0.1 ** 2
    np.testing.assert_allclose(sampled, covariance, atol=0.05 * np.abs(covariance).max())
