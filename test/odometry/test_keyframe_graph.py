# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pose graph against a nonlinear least-squares solver and against Monte Carlo."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.keyframe_graph import KeyframeGraph, RelativePose

SIGMAS = np.array([0.004, 0.003, 0.005, 0.002, 0.003, 0.0015])
COUNT = 7
LOOPS = (0, 5), (1, 6), (0, 6)


def motion(rng):
    root = rng.normal(0, 0.3, (6, 6)) * SIGMAS + np.diag(SIGMAS)
    return PoseWithCovariance(se3.exp(rng.normal(0, 0.4, 6)), root @ root.T)


def noisy(rng, true_pose):
    """Return a measurement of a pose, its error drawn from the covariance it has."""
    error = rng.multivariate_normal(np.zeros(6), true_pose.covariance)
    return PoseWithCovariance(se3.perturbed(true_pose.matrix, error), true_pose.covariance)


@pytest.fixture
def walk():
    """Return true poses, and the true relative poses of the chain and of the loops."""
    rng = np.random.default_rng(4)
    start, chain = motion(rng), [motion(rng) for _ in range(COUNT - 1)]
    poses = [start.matrix]
    for step in chain:
        poses.append(poses[-1] @ step.matrix)
    loops = {(i, j): PoseWithCovariance(se3.inverse(poses[i]) @ poses[j], motion(rng).covariance)
             for i, j in LOOPS}
    return poses, start, chain, loops


def measured(walk, rng):
    """Return noisy measurements of a walk: the start, and relative poses by their keyframes."""
    _, start, chain, loops = walk
    return noisy(rng, start), [RelativePose(i, i + 1, noisy(rng, step))
                               for i, step in enumerate(chain)], [
        RelativePose(*keys, noisy(rng, pose)) for keys, pose in loops.items()]


def solved(start, chain, loops):
    graph = KeyframeGraph(0, start)
    for step in chain:
        graph.add(step.second, step.pose, step.first)
    for loop in loops:
        graph.update([loop])
    return graph


def poses_by_least_squares(start, measurements, guess):
    """Return the minimum of all whitened errors by SciPy, with numerical derivatives."""
    whiten = [np.linalg.inv(np.linalg.cholesky(m.pose.covariance)) for m in measurements]
    whiten_start = np.linalg.inv(np.linalg.cholesky(start.covariance))

    def residuals(errors):
        poses = [se3.perturbed(*pair) for pair in zip(guess, errors.reshape(-1, 6))]
        parts = [whiten_start @ se3.difference(start.matrix, poses[0])]
        for w, m in zip(whiten, measurements):
            relative = se3.inverse(poses[m.first]) @ poses[m.second]
            parts.append(w @ se3.difference(m.pose.matrix, relative))
        return np.concatenate(parts)

    found = least_squares(residuals, np.zeros(6 * len(guess)), xtol=1e-12, ftol=1e-12)
    poses = [se3.perturbed(*pair) for pair in zip(guess, found.x.reshape(-1, 6))]
    return poses, np.linalg.inv(found.jac.T @ found.jac)


def test_the_poses_are_those_of_nonlinear_least_squares(walk):
    start, chain, loops = measured(walk, np.random.default_rng(1))
    graph = solved(start, chain, loops)
    expected, covariance = poses_by_least_squares(start, [*chain, *loops], graph.matrices)
    correction = np.linalg.norm(
        solved(start, chain, []).matrices[-1][:3, 3] - expected[-1][:3, 3])
    for key in graph.keys:
        off = se3.difference(graph.pose(key).matrix, expected[key])
        assert np.linalg.norm(off[:3]) < 0.03 * correction  # what one linearisation leaves
        own = covariance[6 * key:6 * key + 6, 6 * key:6 * key + 6]
        np.testing.assert_allclose(graph.pose(key).covariance, own, rtol=0.02,
                                   atol=0.02 * np.abs(own).max())


def test_the_order_and_grouping_of_measurements_does_not_matter(walk):
    start, chain, loops = measured(walk, np.random.default_rng(2))
    one_by_one, at_once = solved(start, chain, loops), solved(start, chain, [])
    at_once.update(loops)
    for key in one_by_one.keys:
        off = se3.difference(one_by_one.pose(key).matrix, at_once.pose(key).matrix)
        assert np.all(np.abs(off) < 0.05 * SIGMAS.max())


def test_the_covariance_is_that_of_the_errors(walk):
    """Over many noisy walks the normalised squared errors are chi squared."""
    rng = np.random.default_rng(3)
    true_poses = walk[0]
    nees = {key: [] for key in (0, 3, 6)}
    between = []
    for _ in range(300):
        graph = solved(*measured(walk, rng))
        for key, values in nees.items():
            pose = graph.pose(key)
            error = se3.difference(pose.matrix, true_poses[key])
            values.append(error @ np.linalg.solve(pose.covariance, error))
        pose = graph.relative(2, 6)
        error = se3.difference(pose.matrix, se3.inverse(true_poses[2]) @ true_poses[6])
        between.append(error @ np.linalg.solve(pose.covariance, error))
    for values in [*nees.values(), between]:
        assert np.mean(values) == pytest.approx(6.0, abs=3.5 * np.sqrt(12 / 300))


def test_distances_of_right_measurements_are_chi_squared(walk):
    rng = np.random.default_rng(8)
    distances = []
    for _ in range(300):
        start, chain, loops = measured(walk, rng)
        distances.append(solved(start, chain, []).squared_distance(loops[:2]))
    assert np.mean(distances) == pytest.approx(12.0, abs=3.5 * np.sqrt(24 / 300))


def test_a_false_measurement_is_far(walk):
    start, chain, loops = measured(walk, np.random.default_rng(5))
    graph = solved(start, chain, loops[:1])
    right = loops[1]
    false = RelativePose(right.first, right.second, PoseWithCovariance(
        se3.perturbed(right.pose.matrix, [0.1, 0, 0, 0, 0, 0]), right.pose.covariance))
    assert graph.squared_distance([right]) < 22.5
    assert graph.squared_distance([false]) > 100.0


def test_a_removed_keyframe_leaves_what_it_told_about_the_others(walk):
    start, chain, loops = measured(walk, np.random.default_rng(6))
    whole, small = (solved(start, chain, loops[:1]) for _ in range(2))
    for key in (2, 3):
        small.remove(key)
    assert small.keys == (0, 1, 4, 5, 6)
    for graph in (whole, small):
        graph.update(loops[1:])
    for key in small.keys:
        np.testing.assert_allclose(small.pose(key).matrix, whole.pose(key).matrix, atol=1e-9)
        np.testing.assert_allclose(small.pose(key).covariance, whole.pose(key).covariance,
                                   atol=1e-12)


def test_a_place_found_again_makes_the_pose_more_certain(walk):
    start, chain, loops = measured(walk, np.random.default_rng(7))
    before, after = solved(start, chain, []), solved(start, chain, loops)
    assert (np.trace(after.pose(6).covariance[:3, :3])
            < 0.5 * np.trace(before.pose(6).covariance[:3, :3]))


def test_covariances_stay_symmetric_to_the_last_bit(walk):
    graph = solved(*measured(walk, np.random.default_rng(3)))
    for key in graph.keys:
        covariance = graph.pose(key).covariance
        np.testing.assert_array_equal(covariance, covariance.T)


def test_the_variances_of_several_relative_poses_are_those_of_each(walk):
    graph = solved(*measured(walk, np.random.default_rng(2)))
    graph.remove(2)
    first, second = np.array([0, 3, 5, 4]), np.array([4, 1, 0, 3])
    covariances = [graph.relative(graph.keys[i], graph.keys[j]).covariance
                   for i, j in zip(first, second)]
    np.testing.assert_allclose(
        graph.relative_variances(first, second),
        [(c[:3, :3].trace(), c[3:, 3:].trace()) for c in covariances], rtol=1e-9, atol=1e-15)
    assert graph.relative_variances(first[:0], second[:0]).shape == (0, 2)
