# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Residuals against numerical differentiation, explicit covariances and Monte Carlo."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from aick_ros import kernels
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import Correction, Displacement
from aick_ros.registration.refinement.residuals import (
    NormalEquations, Residuals, _observable_projection, contradict, curvature, gradient_noise,
    point_to_plane, reprojection, track_depth, track_steps, unobservable_projection)
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import SensorSettings
from aick_ros.sources.synthetic import DepthSensor

SENSOR = SensorSettings()
CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
RAY_SIGMA = 0.6 / 525
POSE = se3.exp(np.array([0.05, -0.03, 0.04, 0.03, -0.05, 0.08]))
WIDTH, REACH = 1.7, 0.1
CORNER = np.array([(0.8, 0, 0.6), (-0.6, 0, 0.8), (0, 0.8, 0.6)])  # normals of three walls


def tracks_of(noise=0.0, count=50):
    """Return random tracks as POSE makes them, noise on rays in rad and on depths relative."""
    rng = np.random.default_rng(0)
    points = rng.uniform((-1, -0.7, 1), (1, 0.7, 4), (count, 3))
    moved = se3.transform(POSE, points)
    rays = moved[:, :2] / moved[:, 2:] + rng.normal(0, noise, (count, 2))
    return Tracks(np.arange(count), points, rays,
                  moved[:, 2] * (1 + rng.normal(0, noise, count)),
                  np.full(count, SENSOR.depth_sigma))


def corner_depth(T_corner_camera, normals=CORNER):
    """Return the depth image of planes that meet 2 m before the origin of the corner's frame."""
    v, u = np.indices((480, 640))
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy,
                     np.ones(u.shape)], axis=-1)
    rays = rays @ T_corner_camera[:3, :3].T
    with np.errstate(divide='ignore'):
        depths = ((normals @ (0, 0, 2.0)) - normals @ T_corner_camera[:3, 3]) / (
            rays @ normals.T)
    return np.where(depths > 0, depths, np.inf).min(axis=2).astype(np.float32)


def corner(T_corner_camera=np.eye(4), normals=CORNER):
    return Surface.of(corner_depth(T_corner_camera, normals), CAMERA, SENSOR, 5000)


def numeric_jacobian(function, step=1e-6):
    """Differentiate a function of the pose at POSE by the error of the pose."""
    return np.column_stack([
        (function(se3.perturbed(POSE, step * axis))
         - function(se3.perturbed(POSE, -step * axis))) / (2 * step) for axis in np.eye(6)])


def assert_jacobian(function, where=slice(None), step=1e-6):
    found = function(POSE).jacobian[where]
    numeric = numeric_jacobian(lambda pose: function(pose).values, step)[where]
    np.testing.assert_allclose(found, numeric, rtol=1e-4, atol=1e-5 * np.abs(found).max())


def test_jacobian_of_reprojection():
    # the whitening moves with the pose too: at the true pose that has no effect
    tracks = tracks_of()
    assert_jacobian(lambda pose: reprojection(tracks, pose, RAY_SIGMA, WIDTH))


def test_jacobian_of_reprojection_far_from_its_minimum():
    # with depths without noise the whitening is that of the image alone, the same everywhere
    tracks = dataclasses.replace(tracks_of(noise=0.01), sigmas=np.full(50, 1e-9))
    assert_jacobian(lambda pose: reprojection(tracks, pose, RAY_SIGMA, WIDTH))


def test_jacobian_of_track_depth():
    tracks = tracks_of()
    assert_jacobian(lambda pose: track_depth(tracks, pose, SENSOR, WIDTH))


def test_points_are_compared_where_both_surfaces_are_at_the_stamps(displaced):
    """Those of the source once they are displaced, and then where the target has them."""
    source, target, still = corner(POSE), corner(), Displacement(np.zeros((3, 6)), 1.0)
    moving = Displacement(np.array([[0.01, 0.02, -0.01, 0.01, 0.02, 0.0],
                                    [0.03, 0.0, 0.02, 0.01, 0.0, 0.02],
                                    [-0.02, 0.01, 0.0, 0.0, 0.01, -0.01]]), 480 / 525)
    moved = displaced(moving, source.points.astype(float)).astype(np.float32)
    expected, plain = (point_to_plane(surface, target, POSE, SENSOR, WIDTH, REACH) for surface in (
        dataclasses.replace(source, points=moved), source))
    found = point_to_plane(source, target, POSE, SENSOR, WIDTH, REACH, Correction(moving, still))
    np.testing.assert_allclose(found.points, expected.points, atol=1e-6)
    np.testing.assert_allclose(found.values, expected.values, atol=1e-3)
    there = point_to_plane(source, target, POSE, SENSOR, WIDTH, REACH, Correction(still, moving))
    back = Displacement(-moving.twists, moving.height)
    chosen = se3.transform(POSE, source.points[source.chosen].astype(float))
    seen = {tuple(point) for point in displaced(back, chosen).round(9)}
    assert len(there.points) > 1000 and {tuple(point) for point in there.points.round(9)} <= seen
    assert np.abs(plain.values).max() < 1.0 < min(
        np.abs(found.values).max(), np.abs(there.values).max())


def test_some_points_have_the_residuals_that_they_alone_would_have():
    source, target = corner(POSE), corner()
    few = dataclasses.replace(source, chosen=source.chosen[::4].copy())
    found, expected, every = (
        point_to_plane(surface, target, POSE, SENSOR, WIDTH, REACH, every=one_of)
        for surface, one_of in ((source, 4), (few, 1), (source, 1)))
    assert 0 < len(found.values) < 0.3 * len(every.values)
    for part in ('values', 'jacobian', 'weights', 'points', 'directions'):
        np.testing.assert_array_equal(getattr(found, part), getattr(expected, part))


def test_jacobian_of_point_to_plane():
    source, target = corner(POSE), corner()
    values = point_to_plane(source, target, POSE, SENSOR, WIDTH, REACH).values
    flat = np.abs(values) < 1e-3  # not in the creases, which cells make round
    assert np.count_nonzero(flat) > 1000
    # a step so small that no point falls on another cell
    assert_jacobian(lambda pose: point_to_plane(source, target, pose, SENSOR, WIDTH, REACH), flat,
                    step=1e-8)


def test_noise_as_modelled_does_not_widen_the_robust_weights():
    """The median of the squares is below that of chi squared with two degrees of freedom."""
    tracks = tracks_of()
    angles = np.linspace(0, 6, len(tracks))
    off = 1.1 * RAY_SIGMA * np.column_stack([np.cos(angles), np.sin(angles)])
    exact = dataclasses.replace(tracks, rays=tracks.rays + off, sigmas=np.zeros(len(tracks)))
    weights = reprojection(exact, POSE, RAY_SIGMA, WIDTH).weights
    np.testing.assert_allclose(weights, 1 / (1 + 1.1 ** 2 / WIDTH ** 2) ** 2, rtol=1e-6)


def test_reprojection_is_whitened_by_the_covariance_of_each_track():
    """S = ray_sigma^2 I + s s^T, s by numerical differentiation in the source's inverse depth."""
    tracks = tracks_of(noise=0.005)
    found = reprojection(tracks, POSE, RAY_SIGMA, WIDTH)
    count = len(tracks)

    def predicted(pose, points):
        moved = se3.transform(pose, points)
        return moved[:, :2] / moved[:, 2:]

    def pushed(step):
        return tracks.points / (1 + step * tracks.points[:, 2:])  # 1 / z grows by the step

    s = SENSOR.depth_sigma * (predicted(POSE, pushed(1e-6))
                              - predicted(POSE, pushed(-1e-6))) / 2e-6
    jacobians = numeric_jacobian(
        lambda pose: predicted(pose, tracks.points).ravel()).reshape(count, 2, 6)
    off = predicted(POSE, tracks.points) - tracks.rays
    squares = []
    for i in range(count):
        inverse = np.linalg.inv(RAY_SIGMA ** 2 * np.eye(2) + np.outer(s[i], s[i]))
        values, jacobian = found.values[[i, count + i]], found.jacobian[[i, count + i]]
        square = off[i] @ inverse @ off[i]
        assert values @ values == pytest.approx(square, rel=1e-4)
        np.testing.assert_allclose(jacobian.T @ values, jacobians[i].T @ inverse @ off[i],
                                   rtol=1e-3, atol=1e-4 * np.abs(jacobian.T @ values).max())
        np.testing.assert_allclose(jacobian.T @ jacobian, jacobians[i].T @ inverse @ jacobians[i],
                                   rtol=1e-3, atol=1e-5 * np.abs(jacobian.T @ jacobian).max())
        squares.append(square)
    scale = np.clip(np.median(squares) / stats.chi2.median(2), 1.0, 16.0)
    expected = geman_mcclure(np.array(squares), WIDTH * np.sqrt(scale))
    np.testing.assert_allclose(found.weights, np.tile(expected, 2), rtol=1e-3)


def test_reprojection_of_noise_as_modelled_is_standard_normal():
    rng = np.random.default_rng(3)
    exact = tracks_of(count=4000)
    z = exact.points[:, 2:]
    sources = exact.points / (1 + SENSOR.depth_sigma * rng.normal(size=z.shape) * z)
    seen = exact.rays + rng.normal(0, RAY_SIGMA, exact.rays.shape)
    noisy = dataclasses.replace(exact, points=sources, rays=seen)
    values = reprojection(noisy, POSE, RAY_SIGMA, WIDTH).values.reshape(2, -1)
    np.testing.assert_allclose(np.cov(values), np.eye(2), atol=0.08)


def test_tracks_without_depth_are_skipped():
    tracks = tracks_of()
    depths = tracks.depths.copy()
    depths[::2] = np.nan
    half = track_depth(dataclasses.replace(tracks, depths=depths), POSE, SENSOR, WIDTH)
    whole = track_depth(tracks, POSE, SENSOR, WIDTH)
    np.testing.assert_array_equal(half.values, whole.values[1::2])
    np.testing.assert_array_equal(half.jacobian, whole.jacobian[1::2])
    np.testing.assert_array_equal(half.blocks, whole.blocks[1::2])


def test_point_to_plane_at_the_true_pose_is_zero():
    found = point_to_plane(corner(POSE), corner(), POSE, SENSOR, WIDTH, REACH)
    assert np.abs(found.values).max() < 0.5  # in the creases, which cells make round
    assert np.median(np.abs(found.values)) < 0.02
    assert np.linalg.cond(found.jacobian) < 100  # three walls observe all directions


def noisy_wall(pose, seed):
    depth = DepthSensor().measure(corner_depth(pose, np.array([[0.0, 0, 1]])), CAMERA,
                                  np.random.default_rng(seed))
    return Surface.of(depth, CAMERA, SENSOR, 3000)


def test_the_noise_of_the_information_is_by_the_normals_of_both_frames(monkeypatch):
    """Half the squares of what the Jacobians by the one and by the other normal differ."""
    sums = []
    monkeypatch.setattr('aick_ros.registration.refinement.residuals._observable_projection',
                        lambda *both: sums.extend(both) or np.eye(6))
    source = noisy_wall(POSE, 0)
    found = point_to_plane(source, noisy_wall(np.eye(4), 1), POSE, SENSOR, WIDTH, REACH)
    moved = se3.transform(POSE, source.points[source.chosen].astype(float))
    cells = [np.abs(moved - point).sum(axis=1).argmin() for point in found.points]
    turned = source.normals[source.chosen][cells] @ POSE[:3, :3].T
    differences = found.directions - turned * np.linalg.norm(
        found.directions, axis=1, keepdims=True)
    by_pose = np.hstack([differences, np.cross(found.points - POSE[:3, 3], differences)])
    assert len(found.values) > 1000
    np.testing.assert_allclose(sums[0], found.jacobian.T @ found.jacobian, rtol=1e-6, atol=1e-3)
    expected = by_pose.T @ by_pose / 2
    np.testing.assert_allclose(sums[1], expected, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_array_equal(found.normal_noise, sums[1])


def test_distances_share_a_block_where_the_target_sees_them_within_a_fifth_of_a_ray():
    found = point_to_plane(corner(POSE), corner(), POSE, SENSOR, WIDTH, REACH)
    rays = found.points[:, :2] / found.points[:, 2:]
    off_the_borders = (np.abs(rays / 0.2 - np.rint(rays / 0.2)) > 1e-3).all(axis=1)
    cells = [tuple(cell) for cell in np.floor(rays[off_the_borders] / 0.2).astype(int)]
    pairs = set(zip(cells, found.blocks[off_the_borders].tolist()))
    assert len(pairs) == len(set(cells)) == len({block for _, block in pairs}) > 20


def test_point_to_plane_of_a_noisy_wall_observes_nothing_along_it():
    """Noise of the normals must not count as observed roughness."""
    found = point_to_plane(noisy_wall(POSE, 0), noisy_wall(np.eye(4), 1), POSE, SENSOR, WIDTH,
                           REACH)
    information = found.jacobian.T @ found.jacobian
    assert np.linalg.eigvalsh(information)[:3].max() < 100  # 0.1 m and rad
    assert np.linalg.eigvalsh(information)[3:].min() > 1e5
    for axis in (0, 1, 5):
        assert information[axis, axis] < 300
        assert found.normal_noise[axis, axis] < 300  # of what is not projected alone


def test_directions_are_observed_by_the_share_that_is_not_noise():
    """Two measurements of a Jacobian with independent noise, of a known share in each column."""
    rng, count = np.random.default_rng(8), 40_000
    shares = np.array([0.1, 0.25, 0.4, 0.5, 0.65, 0.85])
    signal = np.sqrt(1 - shares) * rng.normal(size=(count, 6))
    first, second = (signal + np.sqrt(shares) * rng.normal(size=(count, 6)) for _ in range(2))
    # all of it up to a quarter of noise, nothing from three quarters on
    observed = np.sqrt(np.clip((0.75 - shares) / 0.5, 0, 1))
    difference = first - second
    found = _observable_projection(first.T @ first, difference.T @ difference / 2)
    np.testing.assert_allclose(found, np.diag(observed), atol=0.05)


def test_what_is_not_observed_is_the_rest_of_what_is():
    """Of each direction the squares of both parts are all of it; unless all are observed."""
    shares = np.array([0.1, 0.25, 0.4, 0.5, 0.65, 0.85])
    information = np.diag([1e4, 2e4, 3e4, 1e3, 5e4, 1e5])
    observed = _observable_projection(information, shares * information)
    hidden = unobservable_projection(information, shares * information)
    np.testing.assert_allclose(observed @ observed + hidden @ hidden, np.eye(6), atol=1e-5)
    assert unobservable_projection(information, 0.2 * information) is None
    nothing = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    hidden = unobservable_projection(nothing @ information, np.zeros((6, 6)))
    np.testing.assert_allclose(hidden, np.eye(6) - nothing, atol=1e-6)


@pytest.mark.parametrize('share', [0.2, 0.3])
def test_nothing_is_projected_where_all_directions_are_observed(share):
    mixing = np.random.default_rng(9).normal(size=(6, 6))
    information = 1e4 * mixing @ mixing.T
    shares = np.array([0.0, 0.1, 0.1, 0.2, 0.2, share])
    root = np.linalg.cholesky(information)
    found = _observable_projection(information, root @ np.diag(shares) @ root.T)
    values = np.sort(np.linalg.eigvals(found).real)
    np.testing.assert_allclose(values[1:], 1.0, atol=1e-9)
    assert values[0] == pytest.approx(1.0 if share < 0.25 else np.sqrt(0.9), abs=1e-3)


def test_a_room_has_nothing_projected(monkeypatch):
    monkeypatch.delattr('aick_ros.registration.refinement.residuals._observable_projection')
    assert len(point_to_plane(corner(POSE), corner(), POSE, SENSOR, WIDTH, REACH).values) > 300
    with pytest.raises(NameError):
        point_to_plane(noisy_wall(POSE, 0), noisy_wall(np.eye(4), 1), POSE, SENSOR, WIDTH, REACH)


@pytest.mark.parametrize('normal', CORNER, ids=['left', 'right', 'floor'])
def test_point_to_plane_counts_in_units_of_the_noise_along_the_ray(normal):
    """The unit is the distance from the plane by 1.4 sigma of inverse depth."""
    source, target = corner(POSE, normal[None]), corner(normals=normal[None])
    found = point_to_plane(source, target, POSE, SENSOR, WIDTH, REACH)
    moved = se3.transform(POSE, source.points[source.chosen].astype(float))
    moved = moved[target.cells_at(moved)[0]]
    pushed = moved / (1 - 1.4 * SENSOR.depth_sigma * moved[:, 2:])
    np.testing.assert_allclose(1 / np.linalg.norm(found.jacobian[:, :3], axis=1),
                               (pushed - moved) @ normal, rtol=0.02)


@pytest.mark.parametrize('rough', [(0.003, 0.0), (0.0, 0.003), (0.003, 0.004)])
def test_relief_is_noise_of_a_plane(rough):
    """Its variance in inverse depth is the mean of those of the two cells."""
    source, target = (dataclasses.replace(surface, roughness=np.full_like(
        surface.roughness, value)) for surface, value in zip((corner(POSE), corner()), rough))
    flat = [dataclasses.replace(surface, roughness=np.zeros_like(surface.roughness))
            for surface in (source, target)]
    found = point_to_plane(source, target, POSE, SENSOR, WIDTH, REACH)
    smooth = point_to_plane(*flat, POSE, SENSOR, WIDTH, REACH)
    sigma = 1.4 * SENSOR.depth_sigma
    ratio = np.sqrt(1 + np.mean(np.square(rough)) / sigma ** 2)
    np.testing.assert_allclose(smooth.values, ratio * found.values, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(smooth.directions, ratio * found.directions, rtol=1e-5)


def test_point_to_plane_drops_far_pairs_and_other_normals():
    target = corner()
    behind = se3.perturbed(np.eye(4), np.array([0, 0, 0.3, 0, 0, 0]))
    assert len(point_to_plane(corner(), target, behind, SENSOR, WIDTH, 0.1).values) == 0
    assert len(point_to_plane(corner(), target, behind, SENSOR, WIDTH, 1.0).values) > 300
    wall = corner(normals=CORNER[:1])
    turned = corner(normals=np.array([[-0.8, 0, 0.6]]))
    found = point_to_plane(wall, turned, np.eye(4), SENSOR, WIDTH, 100.0)
    assert found.values.shape == (0,)
    assert found.jacobian.shape == (0, 6)


def geman_mcclure(squares, width):
    return 1 / (1 + squares / width ** 2) ** 2


def robust_weights(squares, width, typical, truncation=1e9, least=1.0):
    """Return the weights of reprojection errors with such squares, of an exact camera at rest."""
    count = len(squares)
    points = np.column_stack([np.sqrt(squares), np.zeros(count), np.ones(count)])
    weights = np.empty((2, count))
    kernels.reprojection(points, np.zeros((count, 2)), np.zeros(count), np.eye(4), 1.0,
                         np.array([width, typical, 16.0]), np.array([truncation, least]),
                         np.empty(2 * count), np.empty((2 * count, 6)), weights,
                         np.empty(2 * count, int))
    np.testing.assert_array_equal(weights[0], weights[1])
    return weights[0]


@pytest.mark.parametrize('count', [1, 2, 9, 50])
@pytest.mark.parametrize('noise', [0.0, 0.02, 0.2, 0.9])
def test_depths_have_weights_by_the_median_of_their_squares(count, noise):
    found = track_depth(tracks_of(noise, count), POSE, SENSOR, WIDTH)
    squares = found.values ** 2
    scale = np.clip(np.median(squares) / stats.chi2.median(1), 1.0, 16.0)
    np.testing.assert_allclose(found.weights, geman_mcclure(squares, WIDTH * np.sqrt(scale)))


def test_distances_have_weights_by_the_median_of_their_squares():
    off = se3.perturbed(POSE, np.array([0.02, 0.01, -0.02, 0.0, 0.0, 0.0]))
    found = point_to_plane(corner(POSE), corner(), off, SENSOR, WIDTH, REACH)
    squares = found.values ** 2
    scale = np.clip(np.median(squares) / stats.chi2.median(1), 1.0, 16.0)
    assert 1.0 < scale < 16.0
    np.testing.assert_allclose(found.weights, geman_mcclure(squares, WIDTH * np.sqrt(scale)))


@pytest.mark.parametrize('width', [0.5, 1.7, 10.0])
def test_weights_are_those_of_geman_mcclures_cost(width):
    def cost(square):
        return square / (1 + square / width ** 2)

    squares = np.linspace(0.01, 30, 50)
    slope = (cost(squares + 1e-5) - cost(squares - 1e-5)) / 2e-5
    np.testing.assert_allclose(robust_weights(squares, width, np.inf), slope, rtol=1e-6)
    assert robust_weights(np.array([width ** 2]), width, np.inf) == pytest.approx(0.25)


@pytest.mark.parametrize('dimensions', [1, 2])
def test_weights_are_the_same_whatever_makes_all_residuals_larger(dimensions):
    squares = np.random.default_rng(0).chisquare(dimensions, 20000)
    median = stats.chi2.median(dimensions)
    as_the_noise_is = geman_mcclure(squares, WIDTH)
    for scale in (0.5, 1.0):  # the width never shrinks below the noise
        np.testing.assert_allclose(robust_weights(scale ** 2 * squares, WIDTH, median),
                                   geman_mcclure(scale ** 2 * squares, WIDTH), atol=0.01)
    np.testing.assert_allclose(robust_weights(9 * squares, WIDTH, median), as_the_noise_is,
                               atol=0.01)
    assert robust_weights(1e4 * squares, WIDTH, median).mean() < 0.1  # beyond the largest scale
    assert robust_weights(squares[:0], WIDTH, median).shape == (0,)


@pytest.mark.parametrize('scale', [0.05, 0.2, 0.5, 1.0, 3.0, 10.0])
@pytest.mark.parametrize('others', [0.0, 0.5, 0.69])
def test_what_is_far_beyond_the_smallest_third_has_no_weight(scale, others):
    """It is of another motion, if most are, too; the scale is a fifth of the noise at least."""
    rng = np.random.default_rng(1)
    squares = scale ** 2 * rng.chisquare(2, 2000)
    squares[rng.uniform(size=len(squares)) < others] *= 1e4
    third = np.sort(squares)[600] / stats.chi2.ppf(0.3, 2)
    most = 36.0 * max(third, 0.04)
    weights = robust_weights(squares, WIDTH, np.inf, truncation=6.0, least=0.04)
    np.testing.assert_allclose(weights, np.where(
        squares > most, 0.0, geman_mcclure(squares, WIDTH)), rtol=1e-9)
    assert bool(others) == bool(np.mean(weights == 0.0) > 0.4)


def test_tracks_on_an_object_do_not_move_a_pose():
    """Two of three are on a board that has moved by 6 px, and not one of a hundred of the rest."""
    rng, count = np.random.default_rng(5), 90
    points = rng.uniform([-1, -1, 2], [1, 1, 4], (count, 3))
    rays = se3.transform(POSE, points)
    rays = np.ascontiguousarray(rays[:, :2] / rays[:, 2:])
    rays += 0.05 * RAY_SIGMA * rng.standard_normal(rays.shape)
    rays[:60, 0] += 10 * RAY_SIGMA
    tracks = Tracks(np.arange(count), points, rays, np.full(count, np.nan), np.zeros(count))
    pose, _ = track_steps(tracks, POSE, RAY_SIGMA, SENSOR, WIDTH, [3.0, 1.0], 1.0,
                          NormalEquations.of((), 1e-6 * np.eye(6)))
    assert np.abs(se3.difference(pose, POSE)).max() < 3e-4
    weights = reprojection(tracks, pose, RAY_SIGMA, WIDTH).weights[:count]
    assert not weights[:60].any() and weights[60:].min() > 0.9


@pytest.mark.parametrize('count', [1, 2, 3, 4, 7, 8, 51, 52])
@pytest.mark.parametrize('digits', [0, 9], ids=['some equal', 'all different'])
def test_the_width_is_by_the_median_of_few_residuals_too(count, digits):
    squares = np.round(np.random.default_rng(count).uniform(2.0, 18.0, count), digits)
    scale = np.clip(np.median(squares) / stats.chi2.median(2), 1.0, 16.0)
    assert scale not in (1.0, 16.0)
    np.testing.assert_allclose(robust_weights(squares, WIDTH, stats.chi2.median(2)),
                               geman_mcclure(squares, WIDTH * np.sqrt(scale)), rtol=1e-12)


def test_a_third_of_outliers_hardly_widens_the_weights():
    rng = np.random.default_rng(0)
    squares = rng.chisquare(2, 900)
    squares[:300] += 20.0 ** 2
    weights = robust_weights(squares, WIDTH, stats.chi2.median(2))
    assert weights[:300].max() < 0.01
    assert weights[300:].mean() > 0.5


@pytest.mark.parametrize('count, scale, outliers, expected', [
    (400, 3.8, 0.0, False), (400, 4.2, 0.0, True), (400, 1.0, 0.45, False), (400, 1.0, 0.6, True),
    (12, 100.0, 0.0, True), (11, 100.0, 0.0, False), (0, 1.0, 0.0, False)])
def test_depths_contradict_each_other_where_most_differ_by_four_times_their_noise(
        count, scale, outliers, expected):
    """Exact quantiles of the normal distribution; the outliers are 50 times as large."""
    values = scale * stats.norm.ppf((np.arange(count) + 0.5) / max(count, 1))
    values[:round(outliers * count / 2)] *= 50.0
    values[count - round(outliers * count / 2):] *= 50.0
    residuals = Residuals(values, np.zeros((count, 6)), np.ones(count), np.zeros(count, int))
    assert contradict(residuals) is expected


def random_residuals(rng, count):
    return Residuals(rng.normal(size=count), rng.normal(size=(count, 6)),
                     rng.uniform(0, 1, count), rng.integers(0, 10, count))


def test_rays_share_a_block_if_both_numbers_of_theirs_agree():
    """Squares of 0.2 on the plane z = 1; what lies farther out than 2 is in those at the rim."""
    rays = np.random.default_rng(0).uniform(-2.5, 2.5, (400, 2))
    squares = [tuple(square) for square in np.floor(np.clip(rays, -2, 2) / 0.2 + 1e-9).astype(int)]
    same = [[one == other for other in squares] for one in squares]
    tracks = dataclasses.replace(tracks_of(count=len(rays)), rays=rays)
    blocks = reprojection(tracks, np.eye(4), RAY_SIGMA, WIDTH).blocks[:len(rays)]
    np.testing.assert_array_equal(blocks[:, None] == blocks, same)


def test_normal_equations_solve_the_weighted_least_squares():
    rng = np.random.default_rng(4)
    kinds = [random_residuals(rng, count) for count in (30, 50)]
    equations = NormalEquations.of(kinds)
    roots = [np.sqrt(kind.weights) for kind in kinds]
    rows = np.concatenate([kind.jacobian * root[:, None] for kind, root in zip(kinds, roots)])
    values = np.concatenate([kind.values * root for kind, root in zip(kinds, roots)])
    expected = np.linalg.lstsq(rows, -values, rcond=None)[0]
    np.testing.assert_allclose(-np.linalg.solve(equations.information, equations.gradient),
                               expected, rtol=1e-9)


@pytest.mark.parametrize('count', [0, 1, 50])
@pytest.mark.parametrize('wider', [[1.0], [3.0, 1.0, 2.0]])
def test_steps_by_tracks_are_those_of_both_kinds_of_residuals_and_of_others(count, wider):
    tracks = tracks_of(0.01, count)
    tracks.depths[::3] = np.nan
    others = NormalEquations.of([random_residuals(np.random.default_rng(6), 20)], np.eye(6))
    pose, step = track_steps(tracks, np.eye(4), RAY_SIGMA, SENSOR, WIDTH, wider, 0.4, others)
    expected = np.eye(4)
    for ratio in wider:
        kinds = (reprojection(tracks, expected, RAY_SIGMA, WIDTH, ratio),
                 track_depth(tracks, expected, SENSOR, ratio * WIDTH))
        information = sum((kind.jacobian.T * kind.weights) @ kind.jacobian for kind in kinds)
        gradient = sum((kind.jacobian.T * kind.weights) @ kind.values for kind in kinds)
        last = -np.linalg.solve(others.information + 0.4 * information,
                                others.gradient + 0.4 * gradient)
        expected = se3.perturbed(expected, last)
    np.testing.assert_allclose(pose, expected, atol=1e-10)
    np.testing.assert_allclose(step, last, atol=1e-10)


def test_equations_that_are_not_definite_have_no_step():
    none = NormalEquations.of([])
    pose, step = track_steps(tracks_of(count=0), POSE, RAY_SIGMA, SENSOR, WIDTH, [1.0], 1.0, none)
    assert np.isnan(step).all() and np.isnan(pose[:3]).all()


@pytest.mark.parametrize('name', ['rays', 'depths', 'sigmas'])
def test_steps_by_tracks_have_a_row_for_each_track(name):
    tracks = tracks_of()
    short = dataclasses.replace(tracks, **{name: getattr(tracks, name)[1:]})
    with pytest.raises(ValueError, match=f'the {name} has .* numbers: .* are required'):
        track_steps(short, POSE, RAY_SIGMA, SENSOR, WIDTH, [1.0], 1.0, NormalEquations.of([]))


@pytest.mark.parametrize('name', ['a room', 'a wall'])
def test_depth_is_compared_over_its_own_time(name):
    """An error of the motion between the colour images acts on it multiplied by the rate."""
    surfaces = {'a room': (corner(POSE), corner()),
                'a wall': (noisy_wall(POSE, 0), noisy_wall(np.eye(4), 1))}[name]
    motion = se3.exp(se3.log(POSE) / 0.8)
    found = point_to_plane(*surfaces, motion, SENSOR, WIDTH, REACH, rate=0.8)
    expected = point_to_plane(*surfaces, POSE, SENSOR, WIDTH, REACH)
    assert len(found.values) == len(expected.values) > 300
    for of in ('values', 'points', 'directions', 'weights', 'blocks'):
        np.testing.assert_allclose(getattr(found, of), getattr(expected, of), atol=1e-6)
    scale = np.abs(expected.jacobian).max()
    np.testing.assert_allclose(found.jacobian, 0.8 * expected.jacobian, atol=1e-6 * scale)


@pytest.mark.parametrize('count', [1, 2, 3, 10, 101, 1000])
@pytest.mark.parametrize('digits', [12, 1, 0])
def test_robust_weights_are_by_the_median_also_of_equal_residuals(count, digits):
    squares = (20.0 * np.random.default_rng(count).uniform(size=count) ** 2).round(digits)
    scale = np.clip(np.median(squares), 1.0, 16.0)
    np.testing.assert_allclose(robust_weights(squares, WIDTH, 1.0),
                               1 / (1 + squares / (scale * WIDTH ** 2)) ** 2, rtol=1e-12)


def test_residuals_that_are_no_numbers_have_no_weights():
    squares = np.array([np.nan, 1.0, np.nan, np.nan, 2.0, np.nan])
    assert np.isnan(robust_weights(squares, WIDTH, 1.0)).tolist() == np.isnan(squares).tolist()


@pytest.mark.parametrize('common', [0.0, 1.0, 3.0])
@pytest.mark.parametrize('parts, most', [(40, 8.5), (100, 7.0)])
def test_gradient_noise_makes_estimates_consistent(parts, most, common):
    """Monte Carlo: residuals of a block have a common error; NEES of least-squares fits."""
    rng = np.random.default_rng(6)
    size = 15
    blocks = np.repeat(np.arange(parts), size) * 3
    jacobian = np.repeat(rng.normal(size=(parts, 6)), size, axis=0)
    jacobian += 0.3 * rng.normal(size=jacobian.shape)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    squares = []
    for _ in range(400):
        noise = rng.normal(size=len(blocks)) + common * np.repeat(rng.normal(size=parts), size)
        error = inverse @ jacobian.T @ noise
        left = Residuals(noise - jacobian @ error, jacobian, np.ones(len(blocks)), blocks)
        covariance = inverse @ gradient_noise([left]) @ inverse
        squares.append(error @ np.linalg.solve(covariance, error))
    assert 5.0 < np.mean(squares) < most


@pytest.mark.parametrize('dimensions, sigma, expected', [
    (1, 1.0, 0.57), (1, 0.3, 0.92), (2, 1.0, 0.61), (2, 0.3, 0.93)])
def test_by_the_curvature_covariances_are_those_of_robust_estimates(dimensions, sigma, expected):
    """Monte Carlo: NEES; by the weights alone it is three times as large for noise as modelled."""
    rng, blocks = np.random.default_rng(8), np.tile(np.arange(400 // dimensions), dimensions)
    squares = []
    for _ in range(300):
        jacobian, noise = rng.normal(size=(400, 6)), sigma * rng.normal(size=400)
        error = np.zeros(6)
        for _ in range(12):
            values = noise - jacobian @ error
            squared = (values.reshape(dimensions, -1) ** 2).sum(0)
            weights = np.tile(geman_mcclure(squared, 2.0), dimensions)
            left = Residuals(values, jacobian, weights, blocks, dimensions=dimensions)
            equations = NormalEquations.of([left])
            error = error + np.linalg.solve(equations.information, equations.gradient)
        ratio = curvature([left])
        inverse = np.linalg.inv(ratio * equations.information)
        squares.append(error @ np.linalg.solve(inverse @ gradient_noise([left]) @ inverse, error))
    assert np.mean(squares) == pytest.approx(6.0, abs=0.6)
    assert ratio == pytest.approx(expected, abs=0.02)


def test_the_curvature_has_a_floor_and_no_residual_has_that_of_its_weights():
    for weights, ratio in (([0.01] * 5, 0.2), ([], 1.0), ([1.0], 1.0)):
        count = len(weights)
        kind = Residuals(np.ones(count), np.zeros((count, 6)), np.array(weights),
                         np.zeros(count, int))
        assert curvature([kind]) == curvature([kind, kind]) == ratio


def test_the_curvature_of_two_kinds_is_the_mean_by_their_weights():
    kinds = [Residuals(np.ones(count), np.zeros((count, 6)), np.full(count, weight),
                       np.zeros(count, int), dimensions=dimensions)
             for count, weight, dimensions in ((30, 0.81, 1), (40, 0.64, 2))]
    one, other = (curvature([kind]) for kind in kinds)
    assert (one, other) == pytest.approx((4 * 0.9 - 3, 2 * 0.8 - 1))
    assert curvature(kinds) == pytest.approx((24.3 * one + 25.6 * other) / 49.9)


@pytest.mark.parametrize('parts', [14, 20])
def test_few_blocks_are_corrected_by_the_mean_of_an_inverse_wishart_matrix(parts):
    """
    That of the gradients of n blocks is S^-1 / (n - 7), of six unknowns.

    A further n / (n - 6) is for the six that a fit takes, which these gradients are without.
    """
    rng = np.random.default_rng(4)
    blocks, ones = np.arange(parts), np.ones(parts)
    squares = []
    for _ in range(4000):
        gradients, total = rng.normal(size=(parts, 6)), np.sqrt(parts) * rng.normal(size=6)
        noise = gradient_noise([Residuals(ones, gradients, ones, blocks)])
        squares.append(total @ np.linalg.solve(noise, total))
    assert np.mean(squares) == pytest.approx(6.0 * (parts - 6) / parts, rel=0.05)


@pytest.mark.parametrize('sigmas', [-20.0, -0.5, 3.0])
def test_depth_at_a_corner_has_ten_times_the_noise_of_a_pixel(sigmas):
    """A track whose inverse depth is off by so many sigmas, at any depth; larger is positive."""
    tracks = tracks_of(count=5)
    z = se3.transform(POSE, tracks.points)[:, 2]
    off = dataclasses.replace(tracks, depths=1 / (1 / z + sigmas * SENSOR.depth_sigma))
    found = track_depth(off, POSE, SENSOR, WIDTH)
    np.testing.assert_allclose(found.values, sigmas / 10.0, rtol=1e-6)
    # beyond the noise the width grows with the median, here that of all
    scale = max((sigmas / 10.0) ** 2 / 0.4549, 1.0)
    np.testing.assert_allclose(found.weights, 1 / (
        1 + (sigmas / 10.0) ** 2 / (scale * WIDTH ** 2)) ** 2, rtol=1e-3)
