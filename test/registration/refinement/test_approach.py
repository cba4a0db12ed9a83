# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses brought near by a few keypoints, of rendered views whose motion is known."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.approach import Approach
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.settings import Settings

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
SETTINGS = Settings()


def tracker():
    return Tracker(SETTINGS.refinement, SETTINGS.sensor)


def nearer(source, target, pose):
    return Approach(tracker(), SETTINGS.refinement, SETTINGS.sensor).nearer(source, target, pose)


@pytest.mark.parametrize('turn', [[0.04, 0.0, 0.0], [0.0, -0.03, 0.0], [0.0, 0.0, 0.08]])
def test_a_turn_that_was_not_expected_is_seen(rendered_views, turn):
    """By 8 to 10 px, twice as far as a window reaches."""
    _, source, target, motion = rendered_views
    found = nearer(source, target, se3.perturbed(motion, np.r_[0.01, -0.01, 0.01, turn]))
    error = se3.difference(found, motion)
    assert np.linalg.norm(error[:3]) < 0.015 and np.linalg.norm(error[3:]) < 0.006


def test_the_pose_does_not_depend_on_keypoints_of_the_source(rendered_views):
    _, source, target, motion = rendered_views
    none = dataclasses.replace(source, keypoints=dataclasses.replace(
        target.keypoints, positions=target.keypoints.positions + np.float32(1.0)))
    np.testing.assert_array_equal(nearer(source, target, motion), nearer(none, target, motion))


def test_tracks_that_contradict_each_other_are_no_pose(rendered_views):
    """Half of the keypoints seem to be elsewhere, as those of a repeating texture."""
    _, source, target, motion = rendered_views
    positions = target.keypoints.positions.copy()
    assert nearer(source, target, motion) is not None
    positions[np.random.default_rng(3).permutation(len(positions))[len(positions) // 3:]] *= 1.3
    moved = dataclasses.replace(target, keypoints=dataclasses.replace(
        target.keypoints, positions=positions * np.float32((1.2, 0.9, 1.0))))
    assert nearer(source, moved, motion) is None


def test_where_too_few_are_found_nothing_is_known(rendered_views):
    _, source, target, motion = rendered_views
    away = se3.perturbed(motion, [0.0, 0.0, 0.0, 0.0, 2.0, 0.0])
    assert nearer(source, target, away) is None
    dark = dataclasses.replace(source, grey=np.zeros_like(source.grey))
    assert nearer(dark, target, motion) is None


@pytest.mark.parametrize('count, expected', [(60, 60), (1000, None), (7, 7)])
def test_a_few_keypoints_are_tracked_weak_and_strong_ones(rendered_views, count, expected):
    _, source, target, motion = rendered_views
    found = tracker().track_few(target, source, se3.inverse(motion), count)
    known = min(len(target.keypoints), SETTINGS.refinement.max_tracks)
    assert 0.7 * (expected or known) < len(found) < 2 * (expected or known)
    assert found.keypoints[0] < 0.2 * known and found.keypoints[-1] > 0.8 * known
    assert np.isnan(found.depths).all()
    rays = se3.transform(se3.inverse(motion), found.points)
    errors = np.linalg.norm(rays[:, :2] / rays[:, 2:] - found.rays, axis=1)
    assert np.median(errors) < 0.5 / CAMERA.fx
