# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Reprojected depth against what the renderer's colour camera sees, which is exact."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.renderer import Renderer

COLOUR = Camera(320, 240, 262, 262, 159.5, 119.5)
DEPTH = Camera(256, 212, 182, 182, 127.2, 106.1)
T_COLOUR_DEPTH = se3.exp([0.05, -0.01, 0.005, 0.01, -0.02, 0.015])
# an Azure Kinect: pixels of its depth camera cover 1.5 times as much at the border
TIME_OF_FLIGHT = Camera(320, 288, 252.0, 252.0, 166.0, 163.0, 'rational_polynomial', (
    3.131, 2.325, 8e-5, -5e-5, 0.1304, 3.459, 3.350, 0.6629))
WIDE = Camera(640, 360, 302.5, 302.5, 320.0, 180.0, 'rational_polynomial', (
    0.7227, -2.886, 0.0008, -0.0001, 1.633, 0.6022, -2.720, 1.565))
FISHEYE = Camera(320, 240, 142.0, 142.0, 160.0, 120.0, 'equidistant', (-0.01, 0.04, -0.04, 0.007))


@pytest.fixture(scope='module')
def room():
    return SyntheticSource(SyntheticOptions.perfect(seed=3, frames=1))


def views(room, colour, depth, T_colour_depth):
    """Return the depth in the colour camera and in the depth camera, HxW [m]."""
    T_world_colour = room.pose(room.ground_truth.stamps[0])
    surfaces = room.scene.surfaces
    return (Renderer(surfaces, colour).render_depth(T_world_colour),
            Renderer(surfaces, depth).render_depth(T_world_colour @ T_colour_depth))


@pytest.mark.parametrize('depth_camera', [
    DEPTH, Camera(640, 480, 525, 525, 319.5, 239.5), Camera(160, 120, 131, 131, 79.5, 59.5)],
    ids=['about as fine', 'finer', 'coarser'])
@pytest.mark.parametrize('turn', [0.0, np.pi / 2], ids=['upright', 'on its side'])
def test_sees_what_the_colour_camera_sees(room, depth_camera, turn):
    T_colour_depth = T_COLOUR_DEPTH @ se3.exp([0, 0, 0, 0, 0, turn])
    truth, measured = views(room, COLOUR, depth_camera, T_colour_depth)
    found = DepthToColour(depth_camera, COLOUR, T_colour_depth).reproject(measured)
    assert found.dtype == np.float32 and found.shape == truth.shape
    seen = np.isfinite(found) & np.isfinite(truth)
    error = np.abs(found - truth)[seen] / truth[seen]
    assert np.median(error) < 1e-4
    assert np.mean(error < 0.003) > 0.9  # the others lie beside edges


def test_a_slanted_plane_has_no_cracks_and_keeps_its_slope():
    """A floor 0.5 m below the camera: the plane y = 0.5 has a closed form in every camera."""
    v = np.arange(150.0, 240)
    depth = np.full((240, 320), np.nan, np.float32)
    depth[150:] = (262 * 0.5 / (v - 119.5))[:, None]
    found = DepthToColour(COLOUR, COLOUR, se3.exp([0.05, 0, 0, 0, 0, 0])).reproject(depth)
    expected = np.broadcast_to((262 * 0.5 / (v - 119.5))[:, None], (90, 250))
    np.testing.assert_allclose(found[151:239, 50:300], expected[1:-1], rtol=1e-4)


def test_the_nearest_surface_wins():
    """A box in front of a wall, both facing the camera: the wall behind it is hidden."""
    depth = np.full((240, 320), 3.0, np.float32)
    depth[80:160, 120:200] = 1.0
    T_colour_depth = se3.exp([0.2, 0, 0, 0, 0, 0])
    found = DepthToColour(COLOUR, COLOUR, T_colour_depth).reproject(depth)
    moved = 262 * 0.2 / 1.0  # px, by which the box appears further right
    left, right = round(120 + moved), round(199 + moved)
    np.testing.assert_allclose(found[85:155, left + 1:right - 1], 1.0, rtol=1e-6)
    np.testing.assert_allclose(found[85:155, 30:left - 2][:, :100], 3.0, rtol=1e-6)
    wall_moved = round(262 * 0.2 / 3.0)
    shadow = found[85:155, 200 + wall_moved:right]
    assert not np.any(shadow[:, :left - 200 - wall_moved] == 3.0)


def test_no_depth_appears_where_none_is_measured():
    empty = np.full((240, 320), np.nan, np.float32)
    behind = np.full((240, 320), 0.1, np.float32)
    backwards = se3.exp([0, 0, -0.5, 0, 0, 0])
    assert np.isnan(DepthToColour(COLOUR, COLOUR, np.eye(4)).reproject(empty)).all()
    assert np.isnan(DepthToColour(COLOUR, COLOUR, backwards).reproject(behind)).all()


def test_the_same_camera_gives_the_same_image(room):
    truth, measured = views(room, COLOUR, COLOUR, np.eye(4))
    found = DepthToColour(COLOUR, COLOUR, np.eye(4)).reproject(measured)
    assert np.mean(np.abs(found - truth) < 1e-5) > 0.98  # an overlap of 5 % widens the foreground


def test_a_distorted_colour_camera(room):
    """Truth: each pixel of the distorted image is a ray of a fine one without distortion."""
    fine = Camera(1280, 960, 1048, 1048, 639.5, 479.5)
    distorted = dataclasses.replace(COLOUR, distortion=(-0.2, 0.05, 0.001, 0.002, 0.0))
    truth, measured = views(room, fine, DEPTH, T_COLOUR_DEPTH)
    found = DepthToColour(DEPTH, distorted, T_COLOUR_DEPTH).reproject(measured)
    v, u = np.mgrid[20:220:3, 20:300:3]
    x, y = distorted.normalize(np.column_stack([u.ravel(), v.ravel()])).T
    expected = truth[np.rint(1048 * y + 479.5).astype(int), np.rint(1048 * x + 639.5).astype(int)]
    error = np.abs(found[v.ravel(), u.ravel()] / expected - 1)
    assert np.nanmedian(error) < 5e-4
    assert np.nanmean(error < 0.01) > 0.9


def test_oblong_pixels_leave_no_cracks():
    """A wall: every colour pixel that the depth image covers has its depth."""
    oblong = Camera(80, 240, 65.5, 262, 39.5, 119.5)
    wall = np.full((240, 80), 2.0, np.float32)
    for turn in (0.0, np.pi / 2):
        found = DepthToColour(oblong, COLOUR, se3.exp([0, 0, 0, 0, 0, turn])).reproject(wall)
        np.testing.assert_allclose(found[10:230, 50:270], 2.0, rtol=1e-6)


def test_the_footprint_of_a_pixel_is_bounded():
    """A damaged camera_info may describe a depth camera of very few pixels."""
    coarse = Camera(4, 3, 2, 2, 1.5, 1)
    depth = np.full((3, 4), np.nan, np.float32)
    depth[1, 1] = 2.0
    found = DepthToColour(coarse, COLOUR, np.eye(4)).reproject(depth)
    # at most 8 px to each side of column 94 and of row 119.5
    assert np.isfinite(found).sum() == 17 * 16


@pytest.mark.parametrize('turn', [0.0, np.pi / 2, 0.4])
@pytest.mark.parametrize('slope', [(0.5, 0.0), (0.0, 0.5), (0.4, -0.3)])
def test_oblong_pixels_keep_the_slope_of_a_plane(slope, turn):
    """In closed form in both cameras; within a footprint of eight columns the depth changes."""
    oblong = Camera(60, 240, 32.0, 250.0, 29.5, 119.5)
    upright = Camera(200, 220, 300.0, 220.0, 99.5, 109.5)
    T_colour_depth = se3.exp([0.01, -0.02, 0.0, 0.0, 0.0, turn])
    normal, distance = np.array([*slope, 1.0]), 2.0
    moved = T_colour_depth[:3, :3] @ normal

    def depth_of(camera, normal, distance):
        v, u = np.mgrid[:camera.height, :camera.width]
        rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy,
                         np.ones(u.shape)], axis=-1)
        return (distance / (rays @ normal)).astype(np.float32)

    found = DepthToColour(oblong, upright, T_colour_depth).reproject(
        depth_of(oblong, normal, distance))
    truth = depth_of(upright, moved, distance + moved @ T_colour_depth[:3, 3])
    inner = np.s_[30:-30, 30:-30]
    assert np.isfinite(found[inner]).all()
    assert np.abs(found[inner] / truth[inner] - 1).max() < 0.004


def test_one_pixel_becomes_a_footprint_a_tenth_larger_than_it():
    """Of 8 x 4 colour pixels about the ray of the depth pixel."""
    coarse = Camera(5, 5, 262 / 8, 262 / 4, 2.0, 2.0)
    depth = np.full((5, 5), np.nan, np.float32)
    depth[2, 2] = 2.0
    colour = Camera(320, 240, 262, 262, 160.0, 120.0)
    found = DepthToColour(coarse, colour, np.eye(4)).reproject(depth)
    row, column = np.nonzero(np.isfinite(found))
    assert (column.min(), column.max()) == (160 - 4, 160 + 4)  # 4.4 on each side
    assert (row.min(), row.max()) == (120 - 2, 120 + 2)  # 2.2
    assert len(row) == 9 * 5


@pytest.mark.parametrize('pixel', [(0, 0), (239, 319), (0, 319), (239, 0)])
def test_the_corners_are_within_the_image(pixel):
    depth = np.full((240, 320), np.nan, np.float32)
    depth[pixel] = 1.5
    found = DepthToColour(COLOUR, COLOUR, np.eye(4)).reproject(depth)
    assert found[pixel] == 1.5 and np.isfinite(found).sum() == 1


@pytest.mark.parametrize('ratio, is_edge', [(0.0508, False), (0.0518, True)])
def test_across_an_edge_the_inverse_depth_is_not_interpolated(ratio, is_edge):
    """The neighbours of a pixel on either side differ by more than a twentieth of it."""
    camera = Camera(40, 30, 40.0, 40.0, 19.5, 14.5)
    fine = Camera(160, 120, 160.0, 160.0, 79.5, 59.5)
    inverse = np.full((30, 40), 0.5)
    inverse += 0.5 * ratio / 2 * np.clip(np.arange(40) - 19, 0, 2)
    found = DepthToColour(camera, fine, np.eye(4)).reproject((1 / inverse).astype(np.float32))
    row = 1 / found[60, 4 * 20:4 * 20 + 4]
    slope = 0.0 if is_edge else 0.5 * ratio / 2 / 4
    np.testing.assert_allclose(np.diff(row)[:2], slope, atol=1e-5)


def plane_depth(camera, normal, distance):
    """Return z in a camera of the plane normal . x = distance, hxw [m]; its rays are exact."""
    v, u = np.mgrid[:camera.height, :camera.width]
    rays = np.column_stack([camera.normalize(np.column_stack([u.ravel(), v.ravel()])),
                            np.ones(u.size)])
    depth = (distance / (rays @ normal)).astype(np.float32).reshape(u.shape)
    return np.where(depth > 0.0, depth, np.float32(np.nan))


def covered(depth_camera, colour_camera, T_colour_depth, truth):
    """Return which colour pixels see points that the depth image shows, HxW."""
    v, u = np.mgrid[:colour_camera.height, :colour_camera.width]
    points = colour_camera.back_project(np.column_stack([u.ravel(), v.ravel()]), truth.ravel())
    points = (points - T_colour_depth[:3, 3]) @ T_colour_depth[:3, :3]
    u, v = depth_camera.project(points).T
    inside = ((points[:, 2] > 0) & (u >= 0) & (u <= depth_camera.width - 1) & (v >= 0)
              & (v <= depth_camera.height - 1))
    return inside.reshape(truth.shape)


@pytest.mark.parametrize('normal', [(0.0, 0.0, 1.0), (0.3, -0.2, 1.0)], ids=['wall', 'slanted'])
@pytest.mark.parametrize('depth_camera, colour_camera', [
    (TIME_OF_FLIGHT, WIDE), (TIME_OF_FLIGHT, COLOUR), (FISHEYE, COLOUR),
    (dataclasses.replace(COLOUR, distortion=(-0.28, 0.07, 0.0, 0.0, 0.0)), WIDE)],
    ids=['both', 'depth', 'fisheye', 'barrel'])
@pytest.mark.parametrize('turn', [0.0, 1.2])
def test_a_distorted_depth_camera_leaves_no_holes(depth_camera, colour_camera, normal, turn):
    T_colour_depth = se3.exp([-0.03, 0, 0.004, 0, -0.1, turn])
    moved = T_colour_depth[:3, :3] @ normal
    truth = plane_depth(colour_camera, moved, 2.0 + moved @ T_colour_depth[:3, 3])
    inside = covered(depth_camera, colour_camera, T_colour_depth, truth)
    found = DepthToColour(depth_camera, colour_camera, T_colour_depth).reproject(
        plane_depth(depth_camera, np.array(normal), 2.0))
    assert inside.mean() > 0.3 and np.isfinite(found[inside]).all()
    error = np.abs(found[inside] / truth[inside] - 1)
    assert np.percentile(error, 99) < 3e-4


def test_through_a_distorted_column_the_wall_behind_does_not_show():
    """A column at the side, before a wall at 3 m: it would show beside small footprints."""
    wall = plane_depth(TIME_OF_FLIGHT, np.array([0.0, 0.0, 1.0]), 3.0)
    column = np.s_[:, 250:300]
    wall[column] = 0.9
    T_colour_depth = se3.exp([-0.032, 0, 0.004, 0, 0, 0])
    found = DepthToColour(TIME_OF_FLIGHT, WIDE, T_colour_depth).reproject(wall)
    truth = np.full((360, 640), 0.904, np.float32)
    v, u = np.mgrid[:360, :640]
    points = WIDE.back_project(np.column_stack([u.ravel(), v.ravel()]), truth.ravel())
    column, row = TIME_OF_FLIGHT.project(points - T_colour_depth[:3, 3]).T.reshape(2, 360, 640)
    inner = (column > 251) & (column < 298) & (row > 1) & (row < 286)
    assert inner.sum() > 20000
    np.testing.assert_allclose(found[inner], 0.904, rtol=1e-5)


@pytest.mark.parametrize('depth_camera', [COLOUR, TIME_OF_FLIGHT], ids=['pinhole', 'distorted'])
def test_cameras_that_look_across_each_other_give_no_error(depth_camera):
    """As given by the pose between two frames of links, which are no optical frames."""
    across = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.0, 0.0, 0.0))
    depth = np.full((depth_camera.height, depth_camera.width), 2.0, np.float32)
    found = DepthToColour(depth_camera, COLOUR, across).reproject(depth)
    assert found.shape == (240, 320)
