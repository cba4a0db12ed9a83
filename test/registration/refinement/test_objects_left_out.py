# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered room of which a board hides a part, and moves by itself from frame to frame."""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.problem import Problem
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
LEFT, WIDTH, NEAR = 90, 110, 1.0  # px, px and m
LEAP, NEARER = 6, 0.008  # px and m a frame


@pytest.fixture(scope='module')
def views():
    """Return the prepared target and source, and the true pose."""
    source = SyntheticSource(SyntheticOptions(seed=5, frames=2, camera=CAMERA))
    picture = SyntheticSource(SyntheticOptions(seed=77, frames=1, camera=CAMERA)).frame(0).colour
    registrar = Registrar()

    def with_board(frame, number):
        left = LEFT + number * LEAP
        colour, depth = frame.colour.copy(), frame.depth.copy()
        board = slice(30, 210), slice(left, left + WIDTH)
        colour[board] = cv2.GaussianBlur(picture, (0, 0), 1.0)[30:210, 60:60 + WIDTH]
        depth[board] = NEAR - number * NEARER
        return registrar.prepare(dataclasses.replace(frame, colour=colour, depth=depth))

    target, moved = (with_board(source.frame(i), i) for i in range(2))
    poses = source.ground_truth.poses
    return moved, target, se3.inverse(poses[0]) @ poses[1]


def refined(views, **of):
    source, target, truth = views
    settings = Settings()
    return Refinement(settings.refinement, settings.sensor).refine(source, target, truth, **of)


def error(found, views):
    return np.linalg.norm(se3.difference(found.T_target_source, views[2])[:3])


def are_on_board(tracks):
    return tracks.points[:, 2] < NEAR + 0.1


def test_neither_its_keypoints_nor_its_depth_have_a_part(views, monkeypatch):
    """With them the pose errs by several times as much."""
    found = refined(views)
    assert not are_on_board(found.tracked).any() and len(found.tracked) > 50
    assert error(found, views) < 0.002
    share_hidden = WIDTH * 180 / (CAMERA.width * CAMERA.height)
    assert found.fit.has_objects
    assert 1.0 - 2.0 * share_hidden < found.fit.scene_share < 1.0 - 0.5 * share_hidden
    assert len(found.fit.squared_errors) == len(found.tracked)
    monkeypatch.setattr(Problem, 'leave_out_objects', lambda *_: False)
    with_it = refined(views)
    assert not with_it.fit.has_objects
    assert error(with_it, views) > 3.0 * error(found, views)


def test_the_depth_of_an_object_whose_tracks_others_know_has_no_part(views, monkeypatch):
    """As where its keypoints are not asked for."""
    source, target, truth = views
    everything = refined(views)
    monkeypatch.setattr(Problem, 'leave_out_objects', lambda *_: False)
    of_board = source.keypoints.positions[:, 2] < NEAR + 0.1
    bare = dataclasses.replace(source, keypoints=source.keypoints[np.flatnonzero(~of_board)])
    settings = Settings()
    refinement = Refinement(settings.refinement, settings.sensor)
    tracks = refinement.first_tracks.of(source, target, truth)
    moving = tracks[are_on_board(tracks)]
    assert len(moving) > 12
    without = refinement.refine(bare, target, truth)
    found = refinement.refine(bare, target, truth, moving=moving)
    assert error(found, views) < 0.002 and error(found, views) < 0.5 * error(without, views)
    assert found.fit.scene_share == pytest.approx(everything.fit.scene_share, abs=0.1)


def remembering(views):
    """Return a refinement that has seen the board move."""
    settings = Settings()
    refinement = Refinement(settings.refinement, settings.sensor)
    source, target, _ = views
    found = refined(views)
    refinement.remember_objects(source, target, found.T_target_source, found.tracked, found.fit)
    return refinement


def with_keypoints(view, are_kept):
    """Return a view with some of its keypoints."""
    return dataclasses.replace(view, keypoints=view.keypoints[np.flatnonzero(are_kept)])


def test_what_has_moved_before_stays_excluded_though_the_pose_explains_it(views):
    """As a turn and a shift may explain two motions."""
    refinement, target = remembering(views), views[1]
    known = refinement.refine(target, target, np.eye(4))
    beside = refinement.without_known_objects(target, target, np.eye(4))
    assert known.fit.known_share > 0.2 and are_on_board(known.tracked).any()
    assert beside.fit.known_share == 0.0 and not are_on_board(beside.tracked).any()
    assert len(beside.tracked) > 50 and beside.fit.objects.count > 12


@pytest.mark.parametrize('count, is_beside', [(11, False), (12, True)])
def test_with_fewer_tracks_beside_it_than_confirm_a_pose_all_have_a_part(views, count, is_beside):
    """The pose may be that of the board, and the share of the tracks on it says so."""
    source, target, truth = views
    of_board = source.keypoints.positions[:, 2] < NEAR + 0.1
    few = with_keypoints(source, of_board | (np.cumsum(~of_board) <= count))
    found = remembering(views).without_known_objects(few, target, truth)
    assert are_on_board(found.tracked).mean() == found.fit.known_share
    if is_beside:
        assert len(found.tracked) == count and found.fit.known_share == 0.0
        assert error(found, views) < 0.5 * LEAP / CAMERA.fx
    else:
        assert found.is_confirmed and found.fit.known_share > 0.9
        assert error(found, views) > 0.5 * LEAP / CAMERA.fx


def test_there_is_no_pose_where_nothing_known_is_in_the_view(views):
    """What has moved may be remembered where no keypoint is: it would be the pose of all."""
    source, target, truth = views
    settings = Settings()
    unaware = Refinement(settings.refinement, settings.sensor)
    assert unaware.without_known_objects(source, target, truth) is None
    right = with_keypoints(source, source.keypoints.pixels[:, 0] > LEFT + LEAP + WIDTH + 10)
    refinement = remembering(views)
    assert len(refinement.refine(right, target, truth).tracked) > 50
    assert refinement.without_known_objects(right, target, truth) is None
