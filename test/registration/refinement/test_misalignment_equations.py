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
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import (
    NO_MISALIGNMENT, Correction, Displacement, Misalignment, image_height)
from aick_ros.registration.refinement.misalignment_equations import (
    DistortionRows, Motion, depth_rows, distortion_rows, keypoint_rows, misalignment_sample)
from aick_ros.registration.refinement.residuals import point_to_plane, reprojection
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.settings import Settings

SETTINGS = Settings()
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
TWISTS = np.array([[0.3, -0.2, 0.25, 0.5, -0.8, 0.6], [-0.1, 0.3, 0.2, 0.2, 0.6, -0.3]])
T_WORLD_SOURCE = se3.exp(np.array([0.35, -0.2, 0.3, 0.1, 0.3, -0.2]))
T_WORLD_TARGET = se3.exp(np.array([0.3, -0.1, 0.25, 0.05, 0.25, -0.1]))
T_TARGET_SOURCE = se3.inverse(T_WORLD_TARGET) @ T_WORLD_SOURCE
STEPS = np.array([1e-3] * 6 + [1e-4] * 2)  # m, rad, s
NO_KEYPOINTS = None
NODES = ROWS, COLUMNS


def on_sphere(pose, rays):
    """Return the points that a camera inside of a ball with a radius of 2 m sees, Nx3."""
    origin, directions = pose[:3, 3], rays @ pose[:3, :3].T
    a, b = (directions ** 2).sum(axis=1), directions @ origin
    z = (-b + np.sqrt(b ** 2 - a * (origin @ origin - 4.0))) / a
    return rays * z[:, None]


def prepared(pose, twist):
    v, u = np.mgrid[:240, :320].reshape(2, -1)
    points = on_sphere(pose, np.column_stack([
        CAMERA.normalize(np.column_stack([u, v]).astype(float)), np.ones(u.size)]))
    depth = points[:, 2].reshape(240, 320).astype(np.float32)
    grey = np.zeros((240, 320), np.uint8)
    return PreparedFrame(RgbdFrame(0, grey, depth, CAMERA), NO_KEYPOINTS, grey, Surface.of(
        depth, CAMERA, SETTINGS.sensor, 4000), twist=twist)


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
    correction = Correction(*(Displacement.of(Misalignment.of(values), 0.0, twist, CAMERA)
                              for twist in TWISTS))
    return (reprojection(correction.tracks(tracks, source, SETTINGS.sensor, T_TARGET_SOURCE),
                         T_TARGET_SOURCE, 1 / CAMERA.fx, 2.0),
            point_to_plane(source.surface, target.surface, T_TARGET_SOURCE, SETTINGS.sensor, 2.0,
                           0.3, correction))


def rows(values=np.zeros(8)):
    """Return Jacobian, values and weights of keypoints and of depth."""
    source, _, tracks = scene()
    motion = Motion(T_TARGET_SOURCE, TWISTS, np.full(2, image_height(CAMERA)))
    keypoints, depth = residuals(values)
    return (keypoint_rows(keypoints, tracks, source.surface, motion, 1.0),
            depth_rows(depth, motion))


def differences(unknown, kind):
    step = STEPS[unknown] * np.eye(8)[unknown]
    return (residuals(step)[kind].values, residuals(-step)[kind].values, 2 * STEPS[unknown])


@pytest.mark.parametrize('unknown', range(8))
def test_the_jacobian_of_keypoints_is_that_of_the_correction(unknown):
    source, _, tracks = scene()
    seen = source.surface.cells_at(tracks.points)[0]
    after, before, step = differences(unknown, 0)
    expected = ((after - before) / step)[np.concatenate([seen, seen + len(tracks)])]
    assert len(expected) > 400
    error = rows()[0][0][:, 6 + unknown] - expected
    assert np.abs(error).max() < 0.05 * np.abs(expected).max()


@pytest.mark.parametrize('unknown', range(8))
def test_the_jacobian_of_depth_is_that_of_the_correction(unknown):
    after, before, step = differences(unknown, 1)
    assert len(after) == len(before) == len(residuals(np.zeros(8))[1].values)
    expected = ((after - before) / step)[::4]
    error = rows()[1][0][:, 6 + unknown] - expected
    assert np.median(np.abs(error)) < 0.05 * np.abs(expected).max()


def test_one_registration_of_exact_data_shows_the_misalignment_it_is_corrected_by_too_much():
    """What corrects images without a misalignment is found, as the error of the correction."""
    applied = np.array([0.004, -0.006, 0.005, 0.004, -0.003, 0.005, 0.003, -0.004])
    sample = misalignment_sample(*rows(applied), Misalignment.of(applied))
    assert np.linalg.norm(sample.gradient) < 0.1 * np.linalg.norm(sample.information @ applied)
    unaware = misalignment_sample(*rows(applied), NO_MISALIGNMENT)
    assert unaware.gradient == pytest.approx(sample.gradient - sample.information @ applied)


def test_the_pose_is_eliminated_as_if_it_were_solved_for():
    """Of the joint least squares the same misalignment, and the same covariance of it."""
    rng = np.random.default_rng(3)
    keypoints, depth = ((rng.normal(size=(count, 14)), rng.normal(size=count),
                         rng.uniform(0.1, 2.0, count)) for count in (30, 50))
    applied = Misalignment.of(rng.normal(size=8))
    sample = misalignment_sample(keypoints, depth, applied)
    jacobian, values, weights = (np.concatenate(both) for both in zip(keypoints, depth))
    normal = jacobian.T @ (weights[:, None] * jacobian) + np.diag([1.0] * 6 + [0.0] * 8)
    solution = np.linalg.solve(normal, -jacobian.T @ (weights * values))
    np.testing.assert_allclose(np.linalg.inv(sample.information), np.linalg.inv(normal)[6:, 6:],
                               rtol=1e-9)
    np.testing.assert_allclose(np.linalg.solve(sample.information, sample.gradient),
                               solution[6:] + applied.values, rtol=1e-9)


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
    of_both = distortion_rows(residuals(np.zeros(8))[1], source, target, T_TARGET_SOURCE)
    if distorts != (1, 1):  # what a corrected frame has been changed by is of that frame alone
        corrected = [dataclasses.replace(frame, distortion=DepthDistortion(is_distorted * nodes))
                     for frame, is_distorted in zip((source, target), distorts)]
        found = distortion_rows(residuals(np.zeros(8))[1], *corrected, T_TARGET_SOURCE).applied
    else:
        found = of_both.jacobian @ nodes.ravel()
    assert of_both.jacobian.shape == (len(expected), nodes.size)
    assert not of_both.applied.any()
    assert np.median(np.abs(found - expected)) < 0.02 * np.abs(expected).max()


def test_the_distortion_is_solved_for_with_the_misalignment_and_the_pose():
    """As in the joint least squares, of what the residuals would be without any correction."""
    rng = np.random.default_rng(8)
    keypoints, depth = ((rng.normal(size=(count, 14)), rng.normal(size=count),
                         rng.uniform(0.1, 2.0, count)) for count in (40, 80))
    by_nodes, undone = rng.normal(size=(80, 30)), rng.normal(size=80)
    applied = Misalignment.of(rng.normal(size=8))
    sample = misalignment_sample(keypoints, depth, applied, DistortionRows(by_nodes, undone))
    joint = sample.with_distortion
    jacobian = np.block([[keypoints[0], np.zeros((40, 30))], [depth[0], by_nodes]])
    values = np.concatenate([keypoints[1] - keypoints[0][:, 6:] @ applied.values,
                             depth[1] - depth[0][:, 6:] @ applied.values - undone])
    weights = np.concatenate([keypoints[2], depth[2]])
    normal = jacobian.T @ (weights[:, None] * jacobian) + np.diag([1.0] * 6 + [0.0] * 38)
    solution = np.linalg.solve(normal, -jacobian.T @ (weights * values))
    np.testing.assert_allclose(np.linalg.inv(joint.information), np.linalg.inv(normal)[6:, 6:],
                               rtol=1e-8)
    np.testing.assert_allclose(np.linalg.solve(joint.information, joint.gradient), solution[6:],
                               rtol=1e-8)


def test_the_misalignment_alone_is_that_with_the_distortion_as_it_is_corrected():
    keypoints, depth = rows()
    source, target, _ = scene()
    by_nodes = distortion_rows(residuals(np.zeros(8))[1], source, target, T_TARGET_SOURCE)
    alone = misalignment_sample(keypoints, depth, NO_MISALIGNMENT)
    both = misalignment_sample(keypoints, depth, NO_MISALIGNMENT, by_nodes)
    np.testing.assert_array_equal(both.information, alone.information)
    np.testing.assert_array_equal(both.gradient, alone.gradient)
    assert alone.with_distortion is None
    np.testing.assert_allclose(both.with_distortion.information[:8, :8], alone.information)


def test_rows_have_the_pose_values_and_weights_of_their_residuals():
    """Of depth a quarter, four times as heavy; of keypoints those on a surface."""
    source, _, tracks = scene()
    keypoints, depth = residuals(np.zeros(8))
    rng = np.random.default_rng(4)
    keypoints, depth = (dataclasses.replace(of, weights=rng.uniform(0.1, 2.0, len(of.values)))
                        for of in (keypoints, depth))
    motion = Motion(T_TARGET_SOURCE, TWISTS, np.full(2, image_height(CAMERA)))
    jacobian, values, weights = depth_rows(depth, motion)
    np.testing.assert_array_equal(jacobian[:, :6], depth.jacobian[::4])
    np.testing.assert_array_equal(values, depth.values[::4])
    np.testing.assert_array_equal(weights, 4 * depth.weights[::4])
    seen = source.surface.cells_at(tracks.points)[0]
    both = np.concatenate([seen, seen + len(tracks)])
    jacobian, values, weights = keypoint_rows(keypoints, tracks, source.surface, motion, 3.0)
    np.testing.assert_array_equal(jacobian[:, :6], keypoints.jacobian[both])
    np.testing.assert_array_equal(values, keypoints.values[both])
    np.testing.assert_array_equal(weights, 3.0 * keypoints.weights[both])


def test_each_frame_has_its_own_motion_and_height():
    """Of images of other heights rows count as shares of their own."""
    _, depth = residuals(np.zeros(8))
    heights = image_height(CAMERA), image_height(CAMERA)

    def by_readout(twists, heights):
        return depth_rows(depth, Motion(T_TARGET_SOURCE, twists, np.array(heights)))[0][:, 13]

    whole = by_readout(TWISTS, heights)
    of_source = by_readout(TWISTS * [[1], [0]], heights)
    of_target = by_readout(TWISTS * [[0], [1]], heights)
    np.testing.assert_allclose(of_source + of_target, whole, atol=1e-12)
    assert np.abs(of_source).max() > 0.1 < np.abs(of_target).max()
    taller = by_readout(TWISTS, (2 * heights[0], 3 * heights[1]))
    np.testing.assert_allclose(of_source / 2 + of_target / 3, taller, atol=1e-12)
