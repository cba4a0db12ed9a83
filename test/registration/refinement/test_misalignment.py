# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a misaligned camera sees, by the exact motion of its two images."""


import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.misalignment import (
    Correction, Displacement, Misalignment, image_height)
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import MisalignmentSettings, SensorSettings

CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
HEIGHT = 480 / 525
TWIST = np.array([0.3, -0.2, 0.25, 0.5, -0.8, 0.6])  # a hand that moves fast
OFFSET = np.array([0.02, -0.01, 0.015, 0.02, -0.03, 0.01])


def displacement_of(misalignment, lag):
    """Return that of the target of two frames."""
    twists, other = np.array([np.zeros(6), TWIST]), Camera(640, 240, 525, 525, 319.5, 119.5)
    return Correction.of(misalignment, (0.0, lag), twists, (other, CAMERA)).target


def rows_of(points):
    return points[:, 1] / points[:, 2] / HEIGHT


def seen_points(count=200):
    """Return points in the view of the camera at its stamp."""
    rng = np.random.default_rng(1)
    z = rng.uniform(0.6, 3.0, count)
    x, y = rng.uniform(-0.5, 0.5, count), rng.uniform(-0.4, 0.4, count)
    return np.column_stack([x * z, y * z, z])


def at_time(points, times):
    """Return where a camera with the twist sees points at times after its stamp."""
    return np.array([se3.transform(se3.exp(-time * TWIST), point[None])[0]
                     for point, time in zip(points, times)])


@pytest.mark.parametrize('lag', [0.0, 0.01])
@pytest.mark.parametrize('misalignment', [
    Misalignment(OFFSET, 0.0, 0.03, 0.0), Misalignment(np.zeros(6), -0.02, 0.0, 0.0),
    Misalignment(np.zeros(6), 0.0, 0.0, 0.02), Misalignment(OFFSET, 0.015, -0.03, 0.02)])
def test_points_of_the_depth_image_return_to_the_stamp(misalignment, lag, displaced):
    points = seen_points()
    times = np.zeros(len(points))
    for _ in range(5):  # the row in which a point is seen depends on when it is seen
        moved = at_time(points, times)
        in_depth = se3.transform(se3.exp(-misalignment.offset), moved)
        times = lag + misalignment.delay + misalignment.depth_readout * rows_of(in_depth)
    displacement = displacement_of(misalignment, lag)
    size = np.abs(in_depth - points).max()
    assert size > 0.01
    assert np.abs(displaced(displacement, in_depth) - points).max() < 0.02 * size
    back = Displacement(-displacement.twists, HEIGHT)
    assert np.abs(displaced(back, points) - in_depth).max() < 0.03 * size


def test_keypoints_return_to_the_stamp_whatever_the_depth_camera_does(displaced):
    points = seen_points()
    times = np.zeros(len(points))
    for _ in range(5):
        seen = at_time(points, times)
        times = 0.02 * rows_of(seen)
    displacement = displacement_of(Misalignment(OFFSET, -0.02, 0.02, 0.03), 0.01)
    assert np.abs(seen - points).max() > 0.005
    assert np.abs(displaced(displacement, seen, 'colour') - points).max() < 2e-4


@pytest.mark.parametrize('kind', ['depth', 'rows', 'both'])
def test_points_are_displaced_to_the_second_order(kind, displaced):
    """What is missing is of the third: with half the displacement an eighth of it is left."""
    errors, points = [], seen_points()
    for size in (0.2, 0.1):
        constant = size * OFFSET / np.linalg.norm(OFFSET) * (kind != 'rows')
        by_row = size * TWIST / np.linalg.norm(TWIST) * (kind != 'depth')
        moved = displaced(Displacement(np.array([constant, STILL, by_row]), HEIGHT), points)
        exact = [se3.transform(se3.exp(constant + row * by_row), point[None])[0]
                 for point, row in zip(points, rows_of(points))]
        errors.append(np.abs(moved - exact).max())
    assert errors[0] < 0.01
    assert errors[0] / errors[1] == pytest.approx(8, rel=0.25)


def test_rows_are_shares_of_the_image_from_its_optical_axis():
    assert image_height(CAMERA) == pytest.approx(HEIGHT)
    pixels = np.array([[0.0, 239.5], [639, 0], [5, 479], [7, 119.5], [7, 959.5], [7, -719.5]])
    points = CAMERA.back_project(pixels, np.array([1.0, 2.0, 0.5, 3.0, 1.0, 1.0]))
    along_x = Displacement(np.array([STILL, [1.0, 0, 0, 0, 0, 0], STILL]), HEIGHT)
    nowhere = frame_of_a_wall(missing=slice(None))
    found = Correction(along_x, NOT_MOVED).tracks(
        tracks_of(points, points[:, :2]), nowhere, SENSOR, np.eye(4))
    np.testing.assert_allclose((found.points - points)[:, 0],
                               [0, -239.5 / 480, 239.5 / 480, -0.25, 1, -1], atol=1e-12)


SENSOR = SensorSettings()
STILL, PLANE = np.zeros(6), 2.0
NOT_MOVED = Displacement(np.zeros((3, 6)), HEIGHT)


def frame_of_a_wall(missing=slice(0)):
    """Return a frame whose depth image is a wall in front of it."""
    depth = np.full((480, 640), PLANE, np.float32)
    depth[:, missing] = np.nan
    grey = np.zeros((480, 640), np.uint8)
    return PreparedFrame(RgbdFrame(0, grey, depth, CAMERA), KeypointFrame.none(0), grey)


def tracks_of(points, rays):
    count = len(points)
    return Tracks(np.arange(count), points, rays, np.full(count, 3.0), np.full(count, 0.002))


def test_a_track_has_the_depth_of_the_displaced_surface_on_its_own_ray():
    """The depth camera sits 0.1 m ahead: a wall at 2 m from it is 2.1 m from the other one."""
    points = seen_points(40)
    ahead = Displacement(np.array([[0, 0, 0.1, 0, 0, 0], STILL, STILL]), HEIGHT)
    tracks = tracks_of(points, points[:, :2] / points[:, 2:])
    found = Correction(ahead, NOT_MOVED).tracks(tracks, frame_of_a_wall(), SENSOR, np.eye(4))
    np.testing.assert_allclose(found.points[:, 2], 2.1, atol=0.02)
    np.testing.assert_allclose(found.points[:, :2] / found.points[:, 2:], tracks.rays)
    np.testing.assert_allclose(found.rays, tracks.rays)
    for name in ('keypoints', 'depths', 'sigmas'):
        np.testing.assert_array_equal(getattr(found, name), getattr(tracks, name))
    # where there is no depth, its own is kept
    nowhere = frame_of_a_wall(missing=slice(None))
    kept = Correction(ahead, NOT_MOVED).tracks(tracks, nowhere, SENSOR, np.eye(4))
    np.testing.assert_array_equal(kept.points, points)


def straightened(radial, rays):
    """Return tracks of a wall that a lens shows at some rays as another one would show them."""
    correction = Correction.of(Misalignment(np.zeros(6), 0.0, 0.0, 0.0, colour_radial=radial),
                               (0.0, 0.0), np.zeros((2, 6)), (CAMERA, CAMERA))
    points = PLANE * np.column_stack([rays, np.ones(len(rays))])
    return correction.tracks(tracks_of(points, rays), frame_of_a_wall(), SENSOR, np.eye(4))


@pytest.mark.parametrize('radial', [-0.3, -0.1, 0.1, 0.3])
def test_a_lens_is_inverted(radial):
    turns = np.random.default_rng(1).uniform(0, 2 * np.pi, 60)
    rays = np.linspace(0, 0.45, 60)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    found = straightened(radial, rays * (1 + radial * np.square(rays).sum(axis=1, keepdims=True)))
    np.testing.assert_allclose(found.rays, rays, atol=1e-12)
    np.testing.assert_allclose(found.points, PLANE * np.column_stack([rays, np.ones(60)]),
                               atol=1e-6)


def test_rays_that_a_lens_does_not_show_are_turned_as_its_outermost_one():
    """With a coefficient of -0.3 it shows nothing beyond a radius of 0.7."""
    rays = np.array([[1.5, 0.0], [0.0, -4.0], [1e3, 1e3]])
    found = straightened(-0.3, rays)
    np.testing.assert_allclose(found.rays, 1.5 * rays)
    assert np.isfinite(found.points).all()


@pytest.mark.parametrize('colour, depth', [(0.0, 0.1), (0.1, 0.0), (0.1, 0.1)])
def test_a_track_has_the_depth_of_the_row_of_the_depth_image(colour, depth):
    """The camera moves away from a wall; each image is taken row by row, as fast as it is said."""
    points = seen_points(40)
    rows, away = rows_of(points), np.array([0, 0, 1.0, 0, 0, 0])
    by_rows = Displacement(np.array([STILL, colour * away, depth * away]), HEIGHT)
    found = Correction(by_rows, NOT_MOVED).tracks(
        tracks_of(points, points[:, :2] / points[:, 2:]), frame_of_a_wall(), SENSOR, np.eye(4))
    np.testing.assert_allclose(found.points[:, 2], PLANE + depth * rows, atol=0.002)


@pytest.mark.parametrize('count', [0, 1, 4, 33, 70])
def test_both_ends_of_a_track_are_corrected_by_the_rows_of_their_own_frame(count, displaced):
    T_target_source = se3.exp([0.1, -0.05, 0.3, 0.05, 0.1, -0.02])
    rng = np.random.default_rng(2)
    points = np.column_stack([rng.uniform(-0.8, 0.8, (count, 2)), np.full(count, PLANE)])
    rays = rng.uniform(-0.4, 0.4, (count, 2))
    of_source, of_target = (Displacement(np.array([STILL, factor * TWIST, factor * TWIST]), HEIGHT)
                            for factor in (0.01, -0.02))
    found = Correction(of_source, of_target).tracks(
        tracks_of(points, rays), frame_of_a_wall(), SENSOR, T_target_source)
    np.testing.assert_allclose(found.points, displaced(of_source, points, 'colour'), atol=1e-12)
    depths = se3.transform(T_target_source, found.points)[:, 2:]
    seen = displaced(of_target, np.column_stack([rays, np.ones(count)]) * depths, 'colour')
    np.testing.assert_allclose(found.rays, seen[:, :2] / seen[:, 2:], atol=1e-12)
    assert not count or (np.abs(found.rays - rays).max() > 1e-3
                         and np.abs(found.points - points).max() > 1e-3)
    still = Correction(NOT_MOVED, NOT_MOVED).tracks(
        tracks_of(points, rays), frame_of_a_wall(), SENSOR, T_target_source)
    np.testing.assert_array_equal(still.rays, rays)
    np.testing.assert_allclose(still.points, points, atol=1e-12)


@pytest.mark.parametrize('values, sentence', [
    ((0,) * 12, ''),
    ((0.0123, -0.004, -0.0002, np.radians(0.5), 0, np.radians(-1.25), 0, 0, 0, 0, 0, 0),
     'depth is registered to colour with an error: T_colour_depth is rotated by '
     '(0.50, 0.00, -1.25) deg and moved by (12, -4, 0) mm'),
    ((0,) * 6 + (0.0124, 0, 0, 0, 0, 0),
     'depth images are taken 12 ms later than their stamps say'),
    ((0,) * 6 + (-0.0124, 0.02, 0.031, 0, 0, 0),
     'depth images are taken 12 ms earlier than their stamps say; a rolling shutter takes 20 ms '
     'from the first row of colour images to the last; a rolling shutter takes 31 ms from the '
     'first row of depth images to the last'),
    ((0,) * 9 + (-0.1026, 0, 0),
     'the focal length of colour images is 10.3 % shorter than that of the camera'),
    ((0,) * 9 + (0, 0.114, 0),
     'the focal length of depth images is 11.4 % longer than that of the camera'),
    ((0,) * 11 + (-0.0386,), 'the lens of the colour camera bends rays by a radial coefficient of '
     '-0.039 beside its calibration')])
def test_it_is_described_with_its_numbers(values, sentence):
    misalignment = Misalignment.of(np.array(values, float))
    assert misalignment.description == sentence
    assert type(misalignment.delay) is type(misalignment.colour_readout) is float


def test_settings_have_its_numbers_within_their_ranges():
    values = np.array([*OFFSET, 0.03, -0.02, 0.04, -0.1, 0.05, -0.07])
    settings = Misalignment.of(values).settings
    assert settings == MisalignmentSettings(0.02, -0.01, 0.015, 0.02, -0.03, 0.01, 0.03, -0.02,
                                            0.04, -0.1, 0.05, -0.07)
    np.testing.assert_array_equal(Misalignment.by(settings).values, values)
    assert Misalignment.of(np.full(12, -9.0)).settings == MisalignmentSettings(
        *[-0.2] * 3, *[-0.3] * 3, -0.1, -0.1, -0.1, -0.3, -0.3, -0.3)


def test_the_pose_by_depth_is_between_what_both_depth_images_show():
    """A point of the source's depth image, moved as it is displaced, is in both where it is."""
    rng = np.random.default_rng(2)
    source, target = 0.1 * rng.normal(size=(2, 3, 6))
    correction = Correction(Displacement(source, 1.0), Displacement(target, 1.0))
    T_target_source, point = se3.exp(rng.normal(size=6)), rng.normal(size=(1, 3))
    seen = se3.transform(correction.pose_by_depth(T_target_source), point)
    moved = se3.transform(T_target_source @ se3.exp(source[0]), point)
    np.testing.assert_allclose(se3.transform(se3.exp(target[0]), seen), moved, atol=1e-12)
