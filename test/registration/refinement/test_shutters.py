# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tests of what rolling shutters and a delay make of a pose."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, image_height
from aick_ros.registration.refinement.residuals import PlaneResiduals, reprojection
from aick_ros.registration.refinement.shutters import Shutters, Solution
from aick_ros.registration.tracks import Tracks

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
POSE = se3.exp([0.1, -0.05, 0.08, 0.03, -0.1, 0.05])
READOUT, DELAY = 0.02, -0.015
KEYPOINTS, DEPTH = np.zeros((6, 6)), np.eye(6)  # the gain of a pose that follows one kind


def points_of(count, seed=1):
    """Return points of a scene that fills the image, Nx3."""
    rng = np.random.default_rng(seed)
    rays = CAMERA.normalize(rng.uniform([40, 40], [600, 440], (count, 2)))
    return rng.uniform(1.0, 4.0, (count, 1)) * np.column_stack([rays, np.ones(count)])


def tracks_of(points, seen):
    count = len(points)
    return Tracks(np.arange(count), points, np.ascontiguousarray(seen[:, :2] / seen[:, 2:]),
                  np.full(count, np.nan), np.full(count, 1e-9))


def solution(points, seen, gain):
    """Return a pose with the residuals of points that the target sees, of both kinds."""
    tracks = tracks_of(points, seen)
    keypoints = reprojection(tracks, POSE, 1e-3, 1e9)
    rng = np.random.default_rng(2)
    normals = 100.0 * rng.normal(size=(len(points), 3))
    moved = se3.transform(POSE, points)
    jacobian = np.einsum('ni,nij->nj', normals, se3.point_jacobian(moved - POSE[:3, 3]))
    depth = PlaneResiduals(np.einsum('ni,ni->n', normals, moved - seen), jacobian,
                           np.ones(len(points)), np.zeros(len(points), np.int64), moved, normals)
    return Solution(POSE, tracks, keypoints, [depth], gain)


def frame(variances):
    return SimpleNamespace(frame=SimpleNamespace(camera=CAMERA), twist_variances=variances)


def shift(points, seen, gain):
    """Return the error of the pose that fits the residuals best, 6."""
    found = solution(points, seen, gain)
    residuals = found.depth[0] if gain.any() else found.keypoints
    return np.linalg.lstsq(residuals.jacobian, -residuals.values, rcond=None)[0]


def displaced(points, times, twist):
    return points + times[:, None] * (twist[:3] + np.cross(twist[3:], points))


def rows(points):
    return points[:, 1] / points[:, 2] / image_height(CAMERA)


@pytest.mark.parametrize('gain', [KEYPOINTS, DEPTH])
@pytest.mark.parametrize('of_source', [True, False])
@pytest.mark.parametrize('axis', range(6))
def test_a_shutter_turns_an_error_of_a_velocity_into_that_of_a_pose(gain, of_source, axis):
    """As the least-squares pose of points that are displaced by the times of their rows."""
    points = points_of(300)
    seen, twist = se3.transform(POSE, points), 1e-3 * np.eye(6)[axis]
    if of_source:
        off = shift(displaced(points, READOUT * rows(points), twist), seen, gain)
    else:
        off = shift(points, displaced(seen, READOUT * rows(seen), twist), gain)
    known, steady = frame(np.square(twist)), frame(None)
    kind = 'depth_readout' if gain.any() else 'colour_readout'
    shutter = dataclasses.replace(NO_MISALIGNMENT, **{kind: READOUT})
    found = Shutters(solution(points, seen, gain), *(
        (known, steady) if of_source else (steady, known))).errors(shutter, 0.0)
    np.testing.assert_allclose(found, np.outer(off, off), rtol=0.02, atol=0.02 * (off @ off))


@pytest.mark.parametrize('gain', [KEYPOINTS, 0.3 * DEPTH, DEPTH])
def test_a_delay_shifts_the_pose_as_far_as_it_follows_depth(gain):
    """By the delay that is estimated, and by that of the stamps."""
    points, variances = points_of(50), np.square([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    found = Shutters(
        solution(points, se3.transform(POSE, points), gain), frame(variances), frame(None)).errors(
            dataclasses.replace(NO_MISALIGNMENT, delay=2 * DELAY), -DELAY)
    axes = np.kron(np.eye(2), POSE[:3, :3])
    np.testing.assert_allclose(
        found, (gain[0, 0] * DELAY) ** 2 * axes @ np.diag(variances) @ axes.T, atol=1e-12)


def test_errors_of_both_frames_add_up_and_those_not_known_add_nothing():
    points, variances = points_of(50), np.full(6, 0.01)
    found = solution(points, se3.transform(POSE, points), 0.5 * DEPTH)
    shutter = dataclasses.replace(NO_MISALIGNMENT, colour_readout=READOUT, delay=DELAY)

    def errors(source, target):
        return Shutters(found, frame(source), frame(target)).errors(shutter, 0.0)

    assert not errors(None, None).any()
    np.testing.assert_allclose(errors(variances, variances),
                               errors(variances, None) + errors(None, variances), atol=1e-15)


def test_without_shutter_and_delay_velocities_do_not_matter():
    points, variances = points_of(50), np.full(6, 0.01)
    assert not Shutters(
        solution(points, se3.transform(POSE, points), 0.5 * DEPTH), frame(variances),
        frame(variances)).errors(NO_MISALIGNMENT, 0.0).any()


def test_without_depth_keypoints_alone_follow():
    points = points_of(50)
    both = solution(points, se3.transform(POSE, points), KEYPOINTS)
    alone = Solution(POSE, both.tracks, both.keypoints, [], KEYPOINTS)
    shutter = dataclasses.replace(NO_MISALIGNMENT, colour_readout=READOUT)
    views = frame(np.ones(6)), frame(np.ones(6))
    np.testing.assert_allclose(*(Shutters(each, *views).errors(shutter, DELAY)
                                 for each in (alone, both)), atol=1e-15)


@pytest.mark.parametrize('share', [0.0, 0.4, 1.0])
def test_a_readout_that_is_not_corrected_is_an_error_by_both_velocities(share):
    """Of what keypoints have a part in; depth has a readout of its own."""
    points, twists = points_of(300), 1e-3 * np.random.default_rng(3).normal(size=(2, 6))
    seen = se3.transform(POSE, points)
    off = shift(*(displaced(each, -READOUT * rows(each), twist)
                  for each, twist in zip((points, seen), twists)), KEYPOINTS)
    found = Shutters(solution(points, seen, share * DEPTH), frame(None), frame(None))
    np.testing.assert_allclose(READOUT * found.by_readout(twists), (1 - share) * off,
                               atol=0.02 * np.abs(off).max())
    assert not found.by_readout(np.zeros((2, 6))).any()
