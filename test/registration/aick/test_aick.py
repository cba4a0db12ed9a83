# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK against the paper's equations written out with plain loops."""

import dataclasses
import math

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import point_fit, se3
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.aick.search import FullSearch
from aick_ros.registration.status import Status
from aick_ros.settings import AickSettings


def keypoint_frame(positions, descriptors, sigma=0.01):
    count = len(positions)
    pixels = 10.0 * np.column_stack([np.arange(count), np.zeros(count)])
    return KeypointFrame(0, np.asarray(positions, np.float32), descriptors,
                         np.tile(np.eye(3, dtype=np.float32) * sigma ** 2, (count, 1, 1)),
                         pixels.astype(np.float32))


def random_pair(seed, count=60, binary=True, noise=0.002, strangers=0.1, turn=0.2):
    """Two views of random points: moved, noisy, and partly of different points."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform((-1, -1, 1), (1, 1, 3), (count, 3))
    T = se3.exp(np.r_[rng.normal(0, 0.1, 3), rng.normal(0, turn, 3)])
    moved = se3.transform(T, positions) + rng.normal(0, noise, (count, 3))
    if binary:
        descriptors = rng.integers(0, 256, (count, 32), dtype=np.uint8)
        descriptors[:count // 20] = descriptors[count // 20]  # the same, so that distances tie
        flips = rng.random((count, 256)) < 0.05
        seen = np.packbits(np.unpackbits(descriptors, axis=1) ^ flips, axis=1)
    else:
        descriptors = rng.normal(0, 1, (count, 64)).astype(np.float32)
        descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
        seen = descriptors + rng.normal(0, 0.02, descriptors.shape).astype(np.float32)
    strange = rng.random(count) < strangers  # half of them look familiar
    moved[strange] = rng.uniform((-1, -1, 1), (1, 1, 3), (strange.sum(), 3))
    unlike = np.flatnonzero(strange)[::2]
    seen[unlike] = seen[unlike][:, ::-1]
    order = rng.permutation(count)
    return (keypoint_frame(positions, descriptors),
            keypoint_frame(moved[order], seen[order]), T)


def d_descriptor(a, b):
    """d_d of Eq. 1 for one pair of descriptors."""
    if a.dtype == np.uint8:
        return sum(bin(int(x) ^ int(y)).count('1') for x, y in zip(a, b)) / (8 * len(a))
    return sum((float(x) - float(y)) ** 2 for x, y in zip(a, b))


def brute_force_register(source, target, settings):
    """Eq. 1 and 2 with plain loops; returns the matches of each iteration and the transform."""
    T = np.eye(4)
    d_d = [[d_descriptor(a, b) for b in target.descriptors] for a in source.descriptors]
    history = []
    for i in range(settings.iterations):
        w = settings.alpha ** i
        threshold = (1 - w) * settings.lambda_e + w * settings.lambda_f
        matches = []
        for a, position in enumerate(source.positions):
            p = T[:3, :3] @ position + T[:3, 3]
            best, best_d = None, math.inf
            for b, q in enumerate(target.positions):
                d_e = math.sqrt(sum((p[k] - float(q[k])) ** 2 for k in range(3)))
                d = (1 - w) * d_e + w * d_d[a][b]
                if d < best_d:
                    best, best_d = b, d
            if not best_d >= threshold:
                matches.append((a, best))
        history.append(matches)
        pairs = np.array(matches)
        T = point_fit.fit(source.positions[pairs[:, 0]], target.positions[pairs[:, 1]])
    return history, T


SCHEDULES = [AickSettings(alpha=0.8, iterations=25), AickSettings(alpha=0.6, iterations=10),
             AickSettings(alpha=0.3, iterations=5),
             AickSettings(alpha=0.6, iterations=8, lambda_e=0.3, lambda_f=0.35),
             AickSettings(alpha=1.0, iterations=2),
             AickSettings(alpha=0.0, iterations=4, lambda_e=0.2)]


@pytest.mark.parametrize('settings', SCHEDULES, ids=str)
@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('seed', [1, 2])
def test_agrees_with_the_equations_match_for_match(settings, binary, seed):
    source, target, _ = random_pair(seed, binary=binary)
    history, T = brute_force_register(source, target, settings)
    for iterations in sorted({1, 2, settings.iterations // 2 or 1, settings.iterations}):
        result = Aick(dataclasses.replace(settings, iterations=iterations)).register(
            source, target)
        assert result.status is Status.OK
        assert result.iterations == iterations
        assert [tuple(match) for match in result.matches] == history[iterations - 1]
    np.testing.assert_allclose(result.T_target_source, T, atol=1e-9)


@pytest.mark.parametrize('seed', range(5))
def test_finds_the_motion_without_a_guess(seed):
    source, target, T = random_pair(seed, count=300, noise=0.001, turn=0.5)
    result = Aick().register(source, target)
    assert result.status is Status.OK
    error = se3.log(se3.inverse(T) @ result.T_target_source)
    assert np.linalg.norm(error[:3]) < 0.002
    assert np.linalg.norm(error[3:]) < 0.001


def test_three_matches_are_enough():
    positions = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 2]], float)
    T = se3.exp([0.1, -0.2, 0.3, 0.2, -0.1, 0.3])
    descriptors = np.random.default_rng(0).integers(0, 256, (3, 32), dtype=np.uint8)
    result = Aick().register(keypoint_frame(positions, descriptors),
                             keypoint_frame(se3.transform(T, positions), descriptors))
    assert result.status is Status.OK
    np.testing.assert_allclose(result.T_target_source, T, atol=1e-6)


def brute_force_matches(source, target, T, w, settings):
    """Eq. 1 and 2 over all pairs of float descriptors, in double precision."""
    difference = source.descriptors[:, None].astype(float) - target.descriptors
    moved = se3.transform(T, source.positions.astype(float))
    d = (1 - w) * np.linalg.norm(moved[:, None] - target.positions, axis=2) + w * (
        difference ** 2).sum(axis=2)
    threshold = (1 - w) * settings.lambda_e + w * settings.lambda_f
    return [(a, b) for a, b in enumerate(d.argmin(axis=1)) if d[a, b] < threshold]


@pytest.mark.parametrize('w', [0.0, 0.05])
def test_a_source_that_has_moved_far_is_searched_anew(w):
    """The candidates near the first pose are not those near the second one."""
    rng = np.random.default_rng(8)
    positions = rng.uniform((-1, -1, 1), (1, 1, 3), (200, 3))
    descriptors = rng.uniform(0, 0.2, (200, 6)).astype(np.float32)
    T = se3.exp([0.4, -0.3, 0.2, 0.1, 0.3, -0.2])
    source = keypoint_frame(positions, descriptors)
    target = keypoint_frame(se3.transform(T, positions) + rng.normal(0, 0.002, (200, 3)),
                            descriptors)
    search = FullSearch(source, target, AickSettings())
    for pose in (np.eye(4), T, np.eye(4), T):
        expected = brute_force_matches(source, target, pose, w, AickSettings())
        assert [tuple(match) for match in search.closest(pose, w)] == expected
    assert len(expected) > 190


@pytest.mark.parametrize('way', [(1, 1, 1), (1, -1, 0), (-1, 0, 0)], ids=str)
@pytest.mark.parametrize('share', [0.5, 0.9, 0.99])
def test_what_is_near_after_a_step_in_any_direction_is_found(way, share):
    """Each target is as far as it may be from where the source has gone, straight ahead."""
    settings = AickSettings()
    step = share * settings.lambda_e * np.array(way, float)
    ahead = 0.99 * settings.lambda_e * step / np.linalg.norm(step)
    sources = np.arange(20)[:, None] * (1.0, 0.0, 0.0) + (0.0, 0.0, 2.0)
    descriptors = np.zeros((20, 6), np.float32)
    search = FullSearch(keypoint_frame(sources, descriptors),
                        keypoint_frame(sources + step + ahead, descriptors), settings)
    T = np.eye(4)
    search.closest(T, 0.0)
    T[:3, 3] = step
    assert search.closest(T, 0.0).tolist() == [[i, i] for i in range(20)]


def test_rounding_of_far_positions_loses_no_match():
    """At 300 m the squares in float32 are exact to some centimetres squared only."""
    rng = np.random.default_rng(9)
    positions = rng.normal(0, 90, (400, 3)) + (0, 0, 300)
    descriptors = rng.uniform(0, 0.2, (400, 6)).astype(np.float32)
    source = keypoint_frame(positions, descriptors)
    target = keypoint_frame(positions + rng.normal(0, 0.002, (400, 3)), descriptors)
    settings = AickSettings(lambda_e=0.01)
    expected = brute_force_matches(source, target, np.eye(4), 0.0, settings)
    matches = FullSearch(source, target, settings).closest(np.eye(4), 0.0)
    assert [tuple(match) for match in matches] == expected
    assert len(expected) > 390


@pytest.mark.parametrize('scale', [1.0, 30.0])
@pytest.mark.parametrize('count', [100, 200])
def test_search_skips_no_pair_that_can_match(scale, count):
    """The candidates kept while the source moves give the matches of all pairs."""
    rng = np.random.default_rng(4)
    positions = scale * rng.normal(0, 0.3, (count, 3)) + (0, 0, scale)
    descriptors = rng.uniform(0, 0.5, (2, count, 6)).astype(np.float32)
    order = rng.permutation(count)
    source = keypoint_frame(positions, descriptors[0])
    target = keypoint_frame(positions[order] + rng.normal(0, 0.01, (count, 3)), descriptors[1])
    settings = AickSettings(lambda_e=0.05)
    search, T, found = FullSearch(source, target, settings), np.eye(4), 0
    for w in (1.0, 0.7, 0.4, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0, 0.3):
        expected = brute_force_matches(source, target, T, w, settings)
        assert [tuple(match) for match in search.closest(T, w)] == expected
        found += len(expected)
        T = T @ se3.exp(rng.normal(0, 0.005, 6) / np.repeat((1, scale), 3))
    assert found > 3 * count


def test_covariance_is_consistent_with_monte_carlo():
    """The scatter of repeated results agrees with the covariance of each (NEES)."""
    rng = np.random.default_rng(5)
    positions = rng.uniform((-1, -1, 1), (1, 1, 3), (80, 3))
    descriptors = rng.integers(0, 256, (80, 32), dtype=np.uint8)
    T = se3.exp([0.1, -0.05, 0.2, 0.1, 0.2, -0.1])
    target = keypoint_frame(se3.transform(T, positions), descriptors, sigma=1e-6)
    aick, errors, covariances = Aick(AickSettings(lambda_e=0.05)), [], []
    for _ in range(400):
        noisy = keypoint_frame(positions + rng.normal(0, 0.003, positions.shape), descriptors,
                               sigma=0.003)
        result = aick.register(noisy, target)
        errors.append(np.r_[
            result.T_target_source[:3, 3] - T[:3, 3],
            se3.log_rotation(result.T_target_source[:3, :3] @ T[:3, :3].T)])
        covariances.append(result.covariance)
    information = np.linalg.inv(np.mean(covariances, axis=0))
    nees = np.einsum('ni,ij,nj->n', errors, information, errors)
    assert 5.4 < nees.mean() < 6.6  # 6 expected, standard deviation of the mean 0.17


@pytest.mark.parametrize('counts', [(0, 50), (50, 0), (2, 50), (0, 0)])
def test_too_few_keypoints(counts):
    rng = np.random.default_rng(0)
    source, target = (keypoint_frame(rng.normal(0, 1, (n, 3)),
                                     rng.integers(0, 256, (n, 32), dtype=np.uint8))
                      for n in counts)
    result = Aick().register(source, target)
    assert result.status is Status.TOO_FEW_KEYPOINTS
    assert str(counts[0]) in result.reason
    assert np.isinf(np.diag(result.covariance)).all()


def test_unlike_frames_have_too_few_matches():
    rng = np.random.default_rng(0)
    source = keypoint_frame(rng.normal(0, 1, (50, 3)), np.zeros((50, 32), np.uint8))
    target = keypoint_frame(rng.normal(0, 1, (50, 3)), np.full((50, 32), 255, np.uint8))
    result = Aick().register(source, target)
    assert result.status is Status.TOO_FEW_MATCHES
    assert 'iteration 0' in result.reason


def test_points_on_a_line_are_degenerate():
    rng = np.random.default_rng(0)
    line = np.outer(np.linspace(0, 1, 50), (1, 2, 3))
    frame = keypoint_frame(line, rng.integers(0, 256, (50, 32), dtype=np.uint8))
    assert Aick().register(frame, frame).status is Status.DEGENERATE_GEOMETRY
