# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is left out of the problem of two frames: a board that moves before a wall."""

import numpy as np
import pytest

from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.found_objects import Places
from aick_ros.registration.refinement.moving_objects import LEAST_SHARE, MovingObjects
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import Settings

CAMERA = Camera(640, 480, 500.0, 500.0, 320.0, 240.0)
WALL, BOARD = 3.0, 1.5  # m away
POSE = se3.exp([0.1, -0.05, 0.02, 0.02, 0.05, -0.01])
NUMBER, ON_BOARD = 180, np.arange(180) >= 120
STAMP, SEEN = 1000, 700


def view(moved):
    """Return tracks, and points of depth, of a wall and of a board that has moved, 3 [m]."""
    rng = np.random.default_rng(5)
    wall = np.column_stack([rng.uniform(-1.5, 1.5, (120, 2)), np.full(120, WALL)])
    board = np.column_stack([rng.uniform(-0.2, 0.2, (60, 2)), np.full(60, BOARD)])
    points = np.vstack([wall, board])
    seen = se3.transform(POSE, points + ON_BOARD[:, None] * np.array(moved))
    tracks = Tracks(np.arange(NUMBER), points, seen[:, :2] / seen[:, 2:], seen[:, 2].copy(),
                    np.full(NUMBER, 1e-3))
    surface = Surface(None, points.astype(np.float32), None, None, np.arange(NUMBER), None)
    return tracks, surface


def objects_of(surface):
    settings = Settings()
    return MovingObjects(NUMBER, surface, CAMERA, 0.6 / CAMERA.fx, settings.refinement,
                         settings.sensor)


def known_of(tracks, on_objects=ON_BOARD):
    """Return what an earlier frame has shown of the target."""
    places = tracks.seen_by_target(POSE)
    return Places(places[~on_objects], places[on_objects], SEEN)


def test_at_first_nothing_is_left_out():
    _, surface = view([0.1, 0.0, 0.0])
    objects = objects_of(surface)
    assert objects.kept.all() and objects.surface is surface and objects.scene_share == 1.0


def test_what_is_far_off_is_left_out_with_its_depth_and_what_is_beside_it():
    tracks, surface = view([0.1, 0.0, 0.0])
    objects = objects_of(surface)
    assert objects.search(tracks, POSE, LEAST_SHARE)
    assert not objects.kept[ON_BOARD].any() and objects.kept[~ON_BOARD].sum() > 90
    np.testing.assert_array_equal(objects.surface.chosen, np.flatnonzero(~ON_BOARD))
    assert objects.scene_share == pytest.approx(120 / 180)
    assert not objects.search(tracks, POSE, LEAST_SHARE)  # as before


def test_without_depth_nothing_is():
    tracks, _ = view([0.1, 0.0, 0.0])
    objects = objects_of(None)
    objects.recall(known_of(tracks), tracks, POSE)
    objects.leave_out_known(tracks, POSE)
    assert not objects.search(tracks, POSE, LEAST_SHARE)
    assert objects.kept.all() and objects.surface is None and objects.scene_share == 1.0


def test_tracks_that_fit_the_motion_of_an_object_better_are_on_it():
    """Of a board that turns about its edge, beside which tracks are two pixels off at most."""
    tracks, surface = view([0.0, 0.0, 0.0])
    rng = np.random.default_rng(9)
    at_axis = np.arange(NUMBER) >= 150
    points = tracks.points
    points[at_axis] = np.column_stack([rng.uniform(-0.22, -0.18, (30, 1)),
                                       rng.uniform(-0.015, 0.015, (30, 1)), np.full(30, BOARD)])
    axis = np.array([-0.2, 0.0, BOARD])
    turned = se3.transform(se3.exp([0, 0, 0, 0, 0, 0.3]), points - axis) + axis
    seen = se3.transform(POSE, np.where(ON_BOARD[:, None], turned, points))
    tracks.rays[:] = seen[:, :2] / seen[:, 2:] + rng.normal(0.0, 0.3 / CAMERA.fx, (NUMBER, 2))
    tracks.depths[:] = seen[:, 2]
    objects = objects_of(surface)
    assert objects.search(tracks, POSE, 0.1)
    assert objects.kept[at_axis].sum() > 10
    assert objects.search(tracks, POSE, 0.1)
    assert not objects.kept[ON_BOARD].any() and objects.kept[~ON_BOARD].sum() > 90


def test_known_objects_are_left_out_before_they_are_far_off():
    """And stay so while they move, however slowly; tracks of the wall have no error here."""
    tracks, surface = view([0.0012, 0.0, 0.0])  # 0.4 px
    without = objects_of(surface)
    assert not without.search(tracks, POSE, LEAST_SHARE) and without.kept.all()
    objects = objects_of(surface)
    objects.recall(known_of(tracks), tracks, POSE)
    assert objects.kept.all()
    objects.leave_out_known(tracks, POSE)
    assert not objects.kept[ON_BOARD].any()
    assert not objects.search(tracks, POSE, LEAST_SHARE) and not objects.kept[ON_BOARD].any()


def test_a_known_object_that_has_stopped_is_a_part_of_the_scene_and_known_as_long_as_it_may_be():
    tracks, surface = view([0.0, 0.0, 0.0])
    objects = objects_of(surface)
    objects.recall(known_of(tracks), tracks, POSE)
    objects.leave_out_known(tracks, POSE)
    assert objects.search(tracks, POSE, LEAST_SHARE)
    assert objects.kept.all() and len(objects.surface.chosen) == NUMBER
    agreeing = np.arange(NUMBER)
    assert objects.known_share(agreeing) == pytest.approx(60 / 180)
    found = objects.found(tracks, agreeing, POSE, STAMP)
    assert found.source.seen == SEEN
    np.testing.assert_array_equal(found.source.objects, tracks.points[ON_BOARD])
    np.testing.assert_array_equal(found.source.scene, tracks.points[~ON_BOARD])


def test_a_single_track_that_is_known_wrongly_is_as_its_neighbours_are():
    tracks, surface = view([0.1, 0.0, 0.0])
    wrong = ON_BOARD.copy()
    wrong[[5, 70, 130, 150]] ^= True
    objects = objects_of(surface)
    objects.recall(known_of(tracks, wrong), tracks, POSE)
    objects.leave_out_known(tracks, POSE)
    assert not objects.kept[ON_BOARD].any() and objects.kept[[5, 70]].all()


def test_where_too_few_others_are_left_known_objects_are_kept():
    tracks, surface = view([0.1, 0.0, 0.0])
    objects = objects_of(surface)
    objects.recall(known_of(tracks, np.arange(NUMBER) >= 8), tracks, POSE)
    objects.leave_out_known(tracks, POSE)
    assert objects.kept.all()
    assert objects.known_share(np.arange(100, 180)) == 1.0
    assert objects.known_share(np.arange(0)) == 0.0


def test_what_is_found_has_moved_now():
    tracks, surface = view([0.1, 0.0, 0.0])
    objects = objects_of(surface)
    objects.search(tracks, POSE, LEAST_SHARE)
    agreeing = np.flatnonzero(objects.kept)
    found = objects.found(tracks, agreeing, POSE, STAMP)
    assert found.source.seen == STAMP
    np.testing.assert_array_equal(found.source.objects, tracks.points[ON_BOARD])
    np.testing.assert_array_equal(found.source.scene, tracks.points[agreeing])


def test_other_tracks_on_objects_take_their_depth_with_them():
    """The problem has those of the wall alone, as far as it has any of them at all."""
    tracks, surface = view([0.1, 0.0, 0.0])
    wall, board = tracks[~ON_BOARD], tracks[ON_BOARD]
    settings = Settings()
    objects = MovingObjects(len(wall), surface, CAMERA, 0.6 / CAMERA.fx, settings.refinement,
                            settings.sensor)
    objects.leave_out(board, wall, POSE)
    assert objects.kept.all()
    np.testing.assert_array_equal(objects.surface.chosen, np.flatnonzero(~ON_BOARD))
    found = objects.found(wall, np.arange(len(wall)), POSE, STAMP)
    np.testing.assert_array_equal(found.source.objects, board.points)
    np.testing.assert_array_equal(found.source.scene, wall.points)


def test_without_objects_none_are_found():
    tracks, surface = view([0.0, 0.0, 0.0])
    objects = objects_of(surface)
    assert not objects.search(tracks, POSE, LEAST_SHARE)
    assert objects.found(tracks, np.arange(NUMBER), POSE, STAMP) is None


def test_without_tracks_nothing_is_known():
    tracks, surface = view([0.1, 0.0, 0.0])
    settings, none = Settings(), tracks[:0]
    objects = MovingObjects(0, surface, CAMERA, 0.6 / CAMERA.fx, settings.refinement,
                            settings.sensor)
    objects.recall(known_of(tracks), none, POSE)
    objects.leave_out_known(none, POSE)
    assert not objects.search(none, POSE, LEAST_SHARE)
    assert objects.found(none, np.arange(0), POSE, STAMP) is None
    assert objects.scene_share == 1.0


def test_depth_near_known_places_of_the_scene_is_of_the_scene_where_no_tracks_are():
    """All points within reach of the board are left out otherwise, such as a floor below it."""
    tracks, surface = view([0.1, 0.0, 0.0])
    floor = np.array([[0.0, 0.5, BOARD + 0.2]])  # 0.36 m from the board
    points = np.vstack([surface.points, floor]).astype(np.float32)
    surface = Surface(None, points, None, None, np.arange(NUMBER + 1), None)
    known = known_of(tracks)
    near = se3.transform(POSE, floor + [[0.0, 0.05, 0.0]])
    for scene, is_kept in ((known.scene, False),
                           (np.vstack([known.scene, near]), True)):
        objects = objects_of(surface)
        objects.recall(Places(scene, known.objects, SEEN), tracks, POSE)
        objects.leave_out_known(tracks, POSE)
        assert (NUMBER in objects.surface.chosen) == is_kept
