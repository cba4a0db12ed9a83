# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints tracked from one rendered image to another, against their true projections."""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.tracker import Tracker, _visible
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SETTINGS = Settings()
TRACKER = Tracker(SETTINGS.refinement, SETTINGS.sensor)


def view_of(frame):
    extractor = KeypointExtractor(SETTINGS.features, SETTINGS.sensor)
    return PreparedFrame(frame, extractor.extract(frame), frame.grey)


@pytest.fixture(scope='module')
def pair():
    """Return a view, one two frames earlier, and the true pose between them."""
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=3))
    poses = source.ground_truth.poses
    return (view_of(source.frame(2)), view_of(source.frame(0)),
            se3.inverse(poses[0]) @ poses[2])


def projected(view, points, T_target_source):
    """Return the true pixels of points and their true depths."""
    moved = se3.transform(T_target_source, points)
    return view.frame.camera.project(moved), moved[:, 2]


def errors_of(tracks, target, T_target_source):
    """Return how far each track is from the true projection [px]."""
    true, _ = projected(target, tracks.points, T_target_source)
    rays = np.column_stack([tracks.rays, np.ones(len(tracks))])
    return np.linalg.norm(target.frame.camera.project(rays) - true, axis=1)


def with_picture(view, change):
    """Return the view with a changed colour image."""
    colour = view.frame.colour.copy()
    change(colour)
    frame = RgbdFrame(view.stamp, colour, view.frame.depth, view.frame.camera)
    return dataclasses.replace(view, frame=frame, grey=frame.grey)


def test_to_a_tenth_of_a_pixel(pair):
    source, target, T_target_source = pair
    shift, _ = projected(target, source.keypoints.positions.astype(float), T_target_source)
    assert np.median(np.linalg.norm(shift - source.keypoints.pixels, axis=1)) > 5
    tracks = TRACKER.track(source, target, T_target_source)
    errors = errors_of(tracks, target, T_target_source)
    assert len(tracks) > 0.6 * len(source.keypoints)
    assert np.median(errors) < 0.1
    assert np.mean(errors < 0.5) > 0.9


def test_from_an_initial_pose_with_an_error_of_pixels(pair):
    source, target, T_target_source = pair
    off = se3.perturbed(T_target_source, np.array([0.01, -0.005, 0.01, 0.008, -0.01, 0.01]))
    tracks = TRACKER.track(source, target, off)
    assert np.median(errors_of(tracks, target, off)) > 3
    errors = errors_of(tracks, target, T_target_source)
    assert len(tracks) > 0.6 * len(source.keypoints)
    assert np.median(errors) < 0.1


@pytest.mark.parametrize('turn', [[0, 0, 0.7], [0.15, 0.2, -0.4]])
def test_an_image_that_has_turned_far(pair, turn):
    """Seen by the same camera turned about its centre, whatever the depth; OpenCV turns it."""
    source, _, _ = pair
    rotation = se3.exp(np.array([0, 0, 0, *turn]))
    camera = source.frame.camera
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    grey = cv2.warpPerspective(source.grey, matrix @ rotation[:3, :3] @ np.linalg.inv(matrix),
                               (camera.width, camera.height), flags=cv2.INTER_CUBIC)
    target = dataclasses.replace(source, grey=grey)
    off = rotation @ se3.exp([0, 0, 0, 0.005, -0.005, 0.01])
    pixels, _ = projected(target, source.keypoints.positions.astype(float), rotation)
    visible = ((pixels > 20) & (pixels < (620, 460))).all(axis=1).sum()
    tracks = TRACKER.track(source, target, off)
    errors = errors_of(tracks, target, rotation)
    assert len(tracks) > 0.6 * visible > 60
    assert np.median(errors) < 0.1


def test_points_and_depths_are_those_of_the_keypoints(pair):
    source, target, T_target_source = pair
    tracks = TRACKER.track(source, target, T_target_source)
    positions = source.keypoints.positions[tracks.keypoints]
    behind_edge = tracks.points[:, 2] < (1 - 1e-6) * positions[:, 2]
    assert 0.0 < np.mean(behind_edge) < 0.2
    np.testing.assert_allclose(tracks.points[~behind_edge], positions[~behind_edge], rtol=1e-6)
    _, depths = projected(target, tracks.points, T_target_source)
    off = np.abs(tracks.depths / depths - 1)
    assert np.nanmedian(off) < 0.002
    assert np.mean(np.isfinite(off)) > 0.9


def test_the_noise_of_inverse_depth_is_that_of_the_model(pair):
    """Sigma_z = a z^b is a z^(b-2) of the inverse depth, to first order; other than for 2 both."""
    source, target, pose = pair
    for exponent in (1.0, 3.0):
        sensor = dataclasses.replace(SETTINGS.sensor, depth_exponent=exponent)
        view = dataclasses.replace(source, keypoints=KeypointExtractor(
            SETTINGS.features, sensor).extract(source.frame))
        tracks = Tracker(SETTINGS.refinement, sensor).track(view, target, pose)
        positions = view.keypoints.positions[tracks.keypoints]
        beside_edge = np.isfinite(depth.nearer_beside(
            view.frame.depth, view.keypoints.pixels[tracks.keypoints], positions[:, 2],
            SETTINGS.refinement.track_window // 2))
        assert beside_edge.any()
        tracks = tracks[~beside_edge]
        z = positions[~beside_edge, 2]
        np.testing.assert_allclose(
            tracks.sigmas, sensor.depth_sigma * z ** exponent / z ** 2, rtol=1e-3)


def test_what_leaves_the_image_is_dropped(pair):
    source, target, T_target_source = pair
    away = se3.perturbed(T_target_source, np.array([0, 0, 0, 0, 0.5, 0]))
    tracks = TRACKER.track(source, target, away)
    pixels, _ = projected(target, source.keypoints.positions.astype(float), away)
    outside = np.flatnonzero(((pixels < 0) | (pixels > (639, 479))).any(axis=1))
    assert len(outside) > 0.3 * len(source.keypoints)
    assert not set(outside) & set(tracks.keypoints)


def test_points_beyond_the_centres_of_the_last_pixels_are_not_in_the_image():
    camera = Camera(64, 48, 50.0, 52.0, 31.5, 23.5)
    pixels = np.array([(0, 0), (63, 47), (-0.1, 20), (63.1, 20), (20, -0.1), (20, 47.1)])
    kept, seen = _visible(camera.back_project(pixels, np.full(6, 2.0)), np.eye(4), camera)
    assert kept.tolist() == [0, 1]
    np.testing.assert_allclose(seen, pixels[:2], atol=1e-4)


@pytest.mark.parametrize('camera', [
    Camera(64, 48, 50.0, 52.0, 31.5, 23.5, 'plumb_bob', (0.1, -0.05, 0.001, 0.002, 0.01)),
    Camera(64, 48, 50.0, 52.0, 31.5, 23.5, 'equidistant', (0.1, -0.05, 0.01, 0.0))])
@pytest.mark.parametrize('count', [0, 100])
def test_visible_points_are_ahead_and_within_the_image(camera, count):
    points = np.random.default_rng(7).normal(0.0, (0.4, 0.4, 1.0), (count, 3))
    points[:2, 2] = 0.0  # these have no pixels
    kept, seen = _visible(points, np.eye(4), camera)
    ahead = np.flatnonzero(points[:, 2] > 0.05)
    pixels = camera.project(points[ahead])
    inside = ((pixels >= 0) & (pixels <= (63, 47))).all(axis=1)
    np.testing.assert_array_equal(kept, ahead[inside])
    np.testing.assert_array_equal(seen, pixels[inside].astype(np.float32))
    assert count == 0 or 0.1 < len(kept) / count < 0.9


def test_visible_points_have_a_pixel_each():
    with pytest.raises(ValueError, match='the pixels found has 4 numbers: 6 are required'):
        kernels.visible(np.ones((3, 3)), np.eye(4), EDGE_CAMERA.model, 0.1,
                        np.zeros(3, np.int64), np.zeros((2, 2), np.float32))


def test_what_is_covered_is_dropped(pair):
    source, target, T_target_source = pair
    pixels, _ = projected(target, source.keypoints.positions.astype(float), T_target_source)
    other = cv2.resize(np.random.default_rng(0).integers(0, 256, (60, 40, 3), np.uint8),
                       (320, 480))

    def cover(colour):
        colour[:, 320:] = other

    tracks = TRACKER.track(source, with_picture(target, cover), T_target_source)
    covered = np.flatnonzero((pixels[:, 0] > 332) & (pixels[:, 0] < 628))
    free = np.flatnonzero((pixels[:, 0] > 12) & (pixels[:, 0] < 308))
    assert min(len(covered), len(free)) > 50
    assert np.isin(covered, tracks.keypoints).mean() < 0.1
    assert np.isin(free, tracks.keypoints).mean() > 0.6


def test_nothing_behind_the_camera(pair):
    source, target, T_target_source = pair
    turned = se3.perturbed(T_target_source, np.array([0, 0, 0, 0, np.pi, 0]))
    tracks = TRACKER.track(source, target, turned)
    assert len(tracks) == 0
    assert tracks.points.shape == (0, 3)
    assert tracks.rays.shape == (0, 2)
    assert tracks.depths.shape == (0,)


def test_a_blank_image_has_no_tracks(pair):
    source, target, T_target_source = pair

    def blank(colour):
        colour[:] = 90

    assert len(TRACKER.track(source, with_picture(target, blank), T_target_source)) == 0


def test_the_strongest_keypoints_only(pair):
    source, target, T_target_source = pair
    few = Tracker(dataclasses.replace(SETTINGS.refinement, max_tracks=50), SETTINGS.sensor)
    tracks = few.track(source, target, T_target_source)
    every = TRACKER.track(source, target, T_target_source)
    np.testing.assert_array_equal(tracks.keypoints, every.keypoints[every.keypoints < 50])


EDGE_CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
BY_FOUR_PIXELS = se3.exp([4 / EDGE_CAMERA.fx, 0, 0, 0, 0, 0])
"""Motion by which a board at 1 m moves by four pixels, and a wall at 4 m by one."""


def view_beside_the_edge_of_a_board(left, beside):
    """Return a board 1 m away before a wall at 4 m, with keypoints beside its left edge."""
    board = cv2.resize(np.random.default_rng(0).integers(60, 200, (30, 30), np.uint8), (160, 160))
    rows = np.arange(50.0, 190.0, 7.0)
    grey, depth = np.full((240, 320), 20, np.uint8), np.full((240, 320), 4.0, np.float32)
    grey[40:200, left:left + 160], depth[40:200, left:left + 160] = board, 1.0
    pixels = np.column_stack([np.full_like(rows, left + beside), rows]).astype(np.float32)
    positions = EDGE_CAMERA.back_project(pixels, depth[rows.astype(int), left + beside])
    sigmas = SETTINGS.sensor.depth_sigma * positions[:, 2] ** 2
    keypoints = KeypointFrame(0, positions.astype(np.float32), np.zeros((20, 32), np.uint8),
                              sigmas[:, None, None] ** 2 * np.eye(3), pixels)
    return PreparedFrame(RgbdFrame(0, np.dstack(3 * [grey]), depth, EDGE_CAMERA), keypoints, grey)


def sigma_beside_an_edge(beside):
    """Return the standard deviation of the inverse depth there: on the wall it is the edge's."""
    sigma = SETTINGS.sensor.depth_sigma
    return np.hypot(sigma, 0.1 * (1 - 1 / 4)) if beside < 0 else sigma


@pytest.mark.parametrize('beside', [-3, -1, 0, 2])
def test_what_is_seen_beside_an_edge_is_on_the_edge(beside):
    """The outline is the board's."""
    source = view_beside_the_edge_of_a_board(80, beside)
    tracks = TRACKER.track(source, view_beside_the_edge_of_a_board(84, beside), BY_FOUR_PIXELS)
    assert len(tracks) > 10
    np.testing.assert_allclose(tracks.points[:, 2], 1.0, rtol=1e-5)
    np.testing.assert_allclose(EDGE_CAMERA.project(tracks.points),
                               source.keypoints.pixels[tracks.keypoints], atol=1e-3)
    assert np.median(errors_of(tracks, source, BY_FOUR_PIXELS)) < 0.1
    np.testing.assert_allclose(tracks.sigmas, sigma_beside_an_edge(beside), rtol=1e-5)


@pytest.mark.parametrize('beside', [-3, -1, 0, 2])
def test_tracked_back_a_keypoint_on_an_edge_is_as_uncertain_as_the_edge(beside):
    """Though the source measures a depth there, as of the wall, with the noise of a surface."""
    target = view_beside_the_edge_of_a_board(80, beside)
    tracks = TRACKER.track_back(view_beside_the_edge_of_a_board(84, beside), target,
                                se3.inverse(BY_FOUR_PIXELS))
    assert len(tracks) > 10
    np.testing.assert_allclose(tracks.sigmas, sigma_beside_an_edge(beside), rtol=1e-5)
    np.testing.assert_allclose(tracks.depths, 1.0, rtol=1e-5)


def test_tracked_back_a_depth_is_at_least_as_uncertain_as_where_the_source_measures_it(pair):
    """At an exponent above 2 it is more so where the source is farther away than the target."""
    near, far, T_far_near = pair
    sensor = dataclasses.replace(SETTINGS.sensor, depth_exponent=3.0)
    tracker = Tracker(SETTINGS.refinement, sensor)
    for source, target, pose in ((near, far, T_far_near), (far, near, se3.inverse(T_far_near))):
        view = dataclasses.replace(target, keypoints=KeypointExtractor(
            SETTINGS.features, sensor).extract(target.frame))
        tracks = tracker.track_back(source, view, pose)
        assert len(tracks) > 50
        known_by = np.maximum(tracks.points[:, 2], view.keypoints.positions[tracks.keypoints, 2])
        assert (tracks.sigmas >= (1 - 1e-5) * sensor.depth_sigma * known_by).all()
