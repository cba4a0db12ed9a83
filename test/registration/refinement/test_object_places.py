# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Objects that move by themselves, by tracks on a wall and on a board in front of it."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement import object_places
from aick_ros.registration.tracks import Tracks

CAMERA = Camera(640, 480, 500.0, 500.0, 320.0, 240.0)
WALL, BOARD = 3.0, 1.5  # m away
POSE = se3.exp([0.1, -0.05, 0.02, 0.02, 0.05, -0.01])


def tracks_at(points):
    """Return tracks of points that a target measures at their places by a pose."""
    seen = se3.transform(POSE, points)
    return Tracks(np.arange(len(points)), points, seen[:, :2] / seen[:, 2:], seen[:, 2].copy(),
                  np.full(len(points), 0.01))


@pytest.fixture
def view():
    """Return tracks on a wall and on a board, and which are on the board."""
    rng = np.random.default_rng(5)
    wall = np.column_stack([rng.uniform(-1.5, 1.5, (120, 2)), np.full(120, WALL)])
    board = np.column_stack([rng.uniform(-0.2, 0.2, (60, 2)), np.full(60, BOARD)])
    return tracks_at(np.vstack([wall, board])), np.arange(180) >= 120


def test_tracks_are_on_an_object_where_most_of_their_neighbours_are_far_off(view):
    """One on the board that fits by chance is, too; those on the wall are wrong tracks."""
    tracks, on_board = view
    far_off = on_board.copy()
    far_off[[125, 140, 170]] = False
    far_off[[3, 50, 90]] = True
    np.testing.assert_array_equal(object_places.on_objects(tracks, far_off, 0.2), on_board)


def test_scattered_tracks_are_no_object(view):
    tracks, _ = view
    assert not object_places.on_objects(tracks, np.arange(180) % 4 == 0, 0.2).any()


@pytest.mark.parametrize('number, is_object', [(36, True), (35, False)])
def test_an_object_has_a_share_of_all_tracks(view, number, is_object):
    """A fifth here."""
    tracks, on_board = view
    some = tracks[np.r_[:180 - 60, 120:120 + number, 120 + number:180]]
    far_off = on_board & (np.arange(180) < 120 + number)
    points = some.points.copy()
    points[120 + number:] = points[:60 - number]  # the rest of the board on the wall
    assert object_places.on_objects(tracks_at(points), far_off, 0.2).any() == is_object


def test_where_hardly_any_others_are_left_there_is_no_object(view):
    tracks, _ = view
    assert not object_places.on_objects(tracks, np.arange(180) >= 11, 0.2).any()


def test_tracks_are_as_most_of_their_neighbours_are(view):
    tracks, on_board = view
    chosen = on_board.copy()
    chosen[[125, 140, 170, 3, 50, 90]] ^= True
    np.testing.assert_array_equal(object_places.as_neighbours(tracks.points, chosen), on_board)


def test_the_displacement_is_the_median_one_in_the_scene(view):
    """Of a board that has moved while the camera has, too; a few wrong tracks do not count."""
    tracks, on_board = view
    moved = np.array([0.03, -0.02, 0.1])
    shifted = tracks_at(tracks.points + moved)
    shifted.points[:] = tracks.points
    shifted.depths[:20] = np.nan
    shifted.depths[20:40] = 0.5
    np.testing.assert_allclose(object_places.displacement(shifted, POSE), moved, atol=1e-9)
    shifted.depths[:] = np.nan
    assert not object_places.displacement(shifted, POSE).any()


def test_tracks_are_where_the_source_sees_them_and_where_the_target_measured_them(view):
    tracks, _ = view
    tracks.depths[0] = np.nan
    places = object_places.places(tracks, POSE)
    assert places.shape == (180 + 179, 3)
    np.testing.assert_array_equal(places[:180], tracks.points)
    np.testing.assert_allclose(places[180:], tracks.points[1:], atol=1e-9)


def test_points_are_of_what_is_nearer_in_space(view):
    tracks, on_board = view
    points = np.float32([[0.1, 0.1, WALL], [0.1, 0.1, BOARD], [0.28, 0.0, BOARD + 0.05]])
    np.testing.assert_array_equal(object_places.are_of_scene(
        points, tracks.points[~on_board], tracks.points[on_board]), [True, False, False])
    nothing = np.empty((0, 3))
    assert object_places.are_of_scene(points, tracks.points, nothing).all()


def test_what_is_far_from_an_object_is_not_on_it_though_no_track_is_nearer():
    """45 % of the distance from the camera: 0.675 m here."""
    points = np.float32([[0.67, 0.0, BOARD], [0.68, 0.0, BOARD], [0.0, 0.0, WALL]])
    np.testing.assert_array_equal(object_places.are_of_scene(
        points, np.empty((0, 3)), np.array([[0.0, 0.0, BOARD]])), [False, True, True])


def test_tracks_beside_an_object_are_those_that_appear_near_it(view):
    """However far behind it they are."""
    edge = np.float32([[0.2, 0.0, BOARD]])  # 66.7 px from the middle of the image
    shown = tracks_at(np.array([[0.2 * 2 + distance * WALL / 500.0, 0.0, WALL]
                                for distance in (-5.0, -3.9, 3.9, 5.0)]))
    np.testing.assert_array_equal(object_places.are_beside(shown, edge, CAMERA, 4.0),
                                  [False, True, True, False])
    assert not object_places.are_beside(shown, edge[:0], CAMERA, 4.0).any()
