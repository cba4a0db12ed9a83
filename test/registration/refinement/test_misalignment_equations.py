# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Derivatives by the misalignment against differences of the residuals it corrects."""

import dataclasses
import functools

import numpy as np
import pytest

from aick_ros.frames.depth_distortion import COLUMNS, ROWS, DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import CELL, Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Correction, Misalignment
from aick_ros.registration.refinement.misalignment_equations import (
    MovingPair, _add_depth, _add_keypoints, misalignment_sample)
from aick_ros.registration.refinement.residuals import point_to_plane, reprojection
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import Settings

SETTINGS = Settings()
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
TWISTS = np.array([[0.3, -0.2, 0.25, 0.5, -0.8, 0.6], [-0.1, 0.3, 0.2, 0.2, 0.6, -0.3]])
T_WORLD_SOURCE = se3.exp(np.array([0.35, -0.2, 0.3, 0.1, 0.3, -0.2]))
T_WORLD_TARGET = se3.exp(np.array([0.3, -0.1, 0.25, 0.05, 0.25, -0.1]))
T_TARGET_SOURCE = se3.inverse(T_WORLD_TARGET) @ T_WORLD_SOURCE
STEPS = np.array([1e-3] * 6 + [1e-4] * 3 + [1e-3] * 3)  # m, rad, s, ratios
NO_KEYPOINTS = None
NODES = ROWS, COLUMNS


def on_sphere(pose, rays):
    """Return the points that a camera inside of a ball with a radius of 2 m sees, Nx3."""
    origin, directions = pose[:3, 3], rays @ pose[:3, :3].T
    a, b = (directions ** 2).sum(axis=1), directions @ origin
    z = (-b + np.sqrt(b ** 2 - a * (origin @ origin - 4.0))) / a
    return rays * z[:, None]


def prepared(pose, twist, focal=1.0):
    """Return a frame; focal: the focal length of its depth image by that of the camera."""
    v, u = np.mgrid[:240, :320].reshape(2, -1)
    points = on_sphere(pose, np.column_stack([
        CAMERA.normalize(np.column_stack([u, v]).astype(float)) / focal, np.ones(u.size)]))
    depth = points[:, 2].reshape(240, 320).astype(np.float32)
    grey = np.zeros((240, 320), np.uint8)
    return PreparedFrame(RgbdFrame(0, grey, depth, CAMERA), NO_KEYPOINTS, grey, Surface.of(
        depth, CAMERA, SETTINGS.sensor, 4000, CELL), twist=twist)


@functools.cache
def scene():
    source, target = prepared(T_WORLD_SOURCE, TWISTS[0]), prepared(T_WORLD_TARGET, TWISTS[1])
    rng = np.random.default_rng(1)
    rays = np.column_stack([rng.uniform(-0.5, 0.5, 300), rng.uniform(-0.35, 0.35, 300),
                            np.ones(300)])
    points = on_sphere(T_WORLD_SOURCE, rays)
    seen = se3.transform(T_TARGET_SOURCE, points)
    return source, target, Tracks(np.arange(300), points, seen[:, :2] / seen[:, 2:],
                                  np.full(300, np.nan), np.full(300, 0.002))


def residuals(values):
    """Return the residuals of keypoints and depth, corrected by a misalignment."""
    source, target, tracks = scene()
    correction = Correction.of(Misalignment.of(values), (0.0, 0.0), TWISTS, (CAMERA, CAMERA))
    return (reprojection(correction.tracks(tracks, source, SETTINGS.sensor, T_TARGET_SOURCE),
                         T_TARGET_SOURCE, 1 / CAMERA.fx, 2.0),
            point_to_plane(source.surface, target.surface, T_TARGET_SOURCE, SETTINGS.sensor, 2.0,
                           0.3, correction))


def moving(source=None, target=None, twists=TWISTS):
    source, target = source or scene()[0], target or scene()[1]
    return MovingPair(source, target, source.surface, T_TARGET_SOURCE, twists)


def one_by_one(residuals, chosen):
    """Yield the residuals as many times, of which only one has a value and a weight: 1."""
    for i in chosen:
        only = np.zeros(len(residuals.values))
        only[i] = 1.0
        yield dataclasses.replace(residuals, values=only, weights=only)


@pytest.mark.parametrize('colour, depth, radial', [
    (-0.1, 0.0, 0.0), (0.0, 0.12, 0.0), (-0.05, 0.08, 0.0), (0.0, 0.0, 0.2), (0.04, 0.0, -0.15)])
def test_images_of_other_focal_lengths_and_lenses_than_the_camera_s_are_corrected(
        colour, depth, radial):
    """As where a colour image is taken for registered: of a ball, at the true pose."""
    def bent(rays):
        return rays * (1 + colour) * (1 + radial * np.square(rays).sum(axis=1, keepdims=True))

    def wide(pose, twist):  # a depth image is wider by its focal length
        taken = prepared(pose, twist, 1 + depth)
        return dataclasses.replace(taken, twist=np.zeros(6))

    source, target = wide(T_WORLD_SOURCE, TWISTS[0]), wide(T_WORLD_TARGET, TWISTS[1])
    exact = scene()[2]
    rays = bent(exact.points[:, :2] / exact.points[:, 2:])
    tracks = dataclasses.replace(
        exact, points=np.column_stack([rays, np.ones(len(rays))]) * exact.points[:, 2:],
        rays=bent(exact.rays))
    misalignment = Misalignment(np.zeros(6), 0.0, 0.0, 0.0, colour, depth, radial)
    sums = []
    for applied in (NO_MISALIGNMENT, misalignment):
        correction = Correction.of(applied, (0.0, 0.0), np.zeros((2, 6)), (CAMERA, CAMERA))
        corrected = correction.tracks(tracks, source, SETTINGS.sensor, T_TARGET_SOURCE)
        by_keypoints = reprojection(corrected, T_TARGET_SOURCE, 1 / CAMERA.fx, 2.0)
        by_depth = point_to_plane(source.surface, target.surface, T_TARGET_SOURCE,
                                  SETTINGS.sensor, 2.0, 0.3, correction)
        sums.append([np.median(np.abs(each.values)) for each in (by_keypoints, by_depth)])
    (keypoints, planes), (corrected_keypoints, corrected_planes) = sums
    assert corrected_keypoints < 0.001 < 0.05 < keypoints
    assert corrected_planes < 0.01 < (planes if depth else 0.5)


def rows_of_keypoints(keypoints=None, weight=1.0):
    """Return the derivatives by pose and misalignment; zero, where there is no surface."""
    tracks, found = scene()[2], []
    keypoints = keypoints or residuals(np.zeros(12))[0]
    for only in one_by_one(keypoints, range(2 * len(tracks))):
        information, gradient = np.zeros((48, 48)), np.zeros(48)
        _add_keypoints(only, tracks, moving(), weight, information, gradient)
        np.testing.assert_allclose(information, np.outer(gradient, gradient) / weight)
        found.append(-gradient / weight)
    assert not np.any(np.array(found)[:, 18:])
    return np.array(found)[:, :18]


def rows_of_depth(depth=None, pair=None):
    """Return the derivatives of some by pose, misalignment and distortion, and what is applied."""
    found, depth = [], depth or residuals(np.zeros(12))[1]
    for only in one_by_one(depth, range(0, len(depth.values), 4)):
        information, gradients = np.zeros((48, 48)), np.zeros((2, 48))
        _add_depth(only, pair or moving(), information, gradients)
        by_value, by_applied = gradients / 4
        np.testing.assert_allclose(information, 4 * np.outer(by_value, by_value), atol=1e-12)
        found.append((-by_value, by_applied @ -by_value / (by_value @ by_value)))
    return tuple(map(np.array, zip(*found)))


def sample_of(keypoints, depth, applied, pair=None, weight=1.0):
    return misalignment_sample(keypoints, depth, scene()[2], pair or moving(), weight, applied)


def differences(unknown, kind):
    step = STEPS[unknown] * np.eye(12)[unknown]
    return (residuals(step)[kind].values, residuals(-step)[kind].values, 2 * STEPS[unknown])


@pytest.mark.parametrize('unknown', range(12))
def test_the_jacobian_of_keypoints_is_that_of_the_correction(unknown):
    source, _, tracks = scene()
    seen = source.surface.cells_at(tracks.points)[0]
    after, before, step = differences(unknown, 0)
    expected = ((after - before) / step)[np.concatenate([seen, seen + len(tracks)])]
    assert len(expected) > 400
    error = rows_of_keypoints()[np.concatenate([seen, seen + len(tracks)]), 6 + unknown] - expected
    assert np.abs(error).max() < 0.05 * np.abs(expected).max()


@pytest.mark.parametrize('unknown', range(12))
def test_the_jacobian_of_depth_is_that_of_the_correction(unknown):
    after, before, step = differences(unknown, 1)
    assert len(after) == len(before) == len(residuals(np.zeros(12))[1].values)
    expected = ((after - before) / step)[::4]
    error = rows_of_depth()[0][:, 6 + unknown] - expected
    assert np.median(np.abs(error)) <= 0.05 * np.abs(expected).max()


def test_one_registration_of_exact_data_shows_the_misalignment_it_is_corrected_by_too_much():
    """What corrects images without a misalignment is found, as the error of the correction."""
    applied = np.array([0.004, -0.006, 0.005, 0.004, -0.003, 0.005, 0.003, -0.004,
                        0.006, 0.005, -0.004, 0.006])
    sample = sample_of(*residuals(applied), Misalignment.of(applied))
    assert np.linalg.norm(sample.gradient) < 0.1 * np.linalg.norm(sample.information @ applied)
    unaware = sample_of(*residuals(applied), NO_MISALIGNMENT)
    assert unaware.gradient == pytest.approx(sample.gradient - sample.information @ applied)


def distorted(surface, nodes):
    """Return a surface whose points are where a camera with a distortion has them."""
    moved = DepthDistortion(-nodes).moved(surface.points, CAMERA)
    return dataclasses.replace(surface, points=moved)


@pytest.mark.parametrize('distorts', [(1, 0), (0, 1), (1, 1)])
def test_the_jacobian_by_the_distortion_is_that_of_distorted_surfaces(distorts):
    """Of either surface, and of both."""
    source, target, _ = scene()
    nodes = np.random.default_rng(7).normal(0, 1e-4, NODES)
    before, after = (point_to_plane(
        *(distorted(frame.surface, sign * is_distorted * nodes)
          for frame, is_distorted in zip((source, target), distorts)),
        T_TARGET_SOURCE, SETTINGS.sensor, 2.0, 0.3) for sign in (1, -1))
    expected = (after.values - before.values)[::4] / 2
    assert len(expected) > 500
    jacobian, applied = rows_of_depth()
    if distorts != (1, 1):  # what a corrected frame has been changed by is of that frame alone
        corrected = [dataclasses.replace(frame, distortion=DepthDistortion(is_distorted * nodes))
                     for frame, is_distorted in zip((source, target), distorts)]
        found = rows_of_depth(pair=moving(*corrected))[1]
    else:
        found = jacobian[:, 18:] @ nodes.ravel()
    assert not applied.any()
    assert np.median(np.abs(found - expected)) < 0.02 * np.abs(expected).max()


def solved(jacobian, values, weights):
    """Return the information and the solution of joint least squares, without the pose."""
    prior = np.diag([1.0] * 6 + [0.0] * (jacobian.shape[1] - 6))
    normal = jacobian.T @ (weights[:, None] * jacobian) + prior
    return (np.linalg.inv(np.linalg.inv(normal)[6:, 6:]),
            np.linalg.solve(normal, -jacobian.T @ (weights * values))[6:])


def test_the_pose_is_eliminated_as_if_it_were_solved_for():
    """Of the joint least squares the same unknowns, and the same information of them."""
    rng = np.random.default_rng(8)
    keypoints, depth = (dataclasses.replace(
        of, values=rng.normal(size=len(of.values)), weights=rng.uniform(0.1, 2.0, len(of.values)))
        for of in residuals(np.zeros(12)))
    pair = moving(*(dataclasses.replace(frame, distortion=DepthDistortion(
        rng.normal(0, 1e-3, NODES))) for frame in scene()[:2]))
    applied = Misalignment.of(rng.normal(0, 0.01, 12))
    sample = sample_of(keypoints, depth, applied, pair, 3.0)
    of_keypoints, (of_depth, undone) = rows_of_keypoints(), rows_of_depth(pair=pair)
    jacobian = np.vstack([np.pad(of_keypoints, ((0, 0), (0, 30))), of_depth])
    values = np.concatenate([keypoints.values, depth.values[::4]])
    weights = np.concatenate([3.0 * keypoints.weights, 4.0 * depth.weights[::4]])
    information, alone = solved(jacobian[:, :18], values, weights)
    np.testing.assert_allclose(sample.information, information, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(sample.gradient, information @ (alone + applied.values), rtol=1e-6,
                               atol=1e-6 * np.abs(sample.gradient).max())
    # with the distortion, of what the residuals would be without any correction of it
    values[len(keypoints.values):] -= undone
    information, joint = solved(jacobian, values, weights)
    joint[:12] += applied.values
    found = sample.with_distortion
    scale = np.abs(information).max()
    np.testing.assert_allclose(found.information, information, rtol=1e-6, atol=1e-9 * scale)
    np.testing.assert_allclose(found.gradient, information @ joint, rtol=1e-6,
                               atol=1e-6 * np.abs(found.gradient).max())


def test_the_derivatives_by_the_pose_are_those_of_the_residuals():
    """Of keypoints those on a surface."""
    source, _, tracks = scene()
    keypoints, depth = residuals(np.zeros(12))
    np.testing.assert_allclose(rows_of_depth()[0][:, :6], depth.jacobian[::4], rtol=1e-12)
    seen = source.surface.cells_at(tracks.points)[0]
    both = np.concatenate([seen, seen + len(tracks)])
    found = rows_of_keypoints()
    np.testing.assert_allclose(found[both, :6], keypoints.jacobian[both], rtol=1e-12)
    assert not np.delete(found, both, 0).any()


def test_each_frame_has_its_own_motion_and_height():
    """Of images of other heights rows count as shares of their own."""
    def of_height(frame, times):
        camera = dataclasses.replace(CAMERA, fy=CAMERA.fy / times)
        return dataclasses.replace(frame, frame=dataclasses.replace(frame.frame, camera=camera))

    def by_readout(twists, times=(1, 1)):
        source, target, _ = scene()
        pair = MovingPair(of_height(source, times[0]), of_height(target, times[1]),
                          source.surface, T_TARGET_SOURCE, twists)
        return rows_of_depth(pair=pair)[0][:, 14]

    whole = by_readout(TWISTS)
    of_source = by_readout(TWISTS * [[1], [0]])
    of_target = by_readout(TWISTS * [[0], [1]])
    np.testing.assert_allclose(of_source + of_target, whole, atol=1e-12)
    assert np.abs(of_source).max() > 0.1 < np.abs(of_target).max()
    taller = by_readout(TWISTS, (2, 3))
    np.testing.assert_allclose(of_source / 2 + of_target / 3, taller, atol=1e-12)
