# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints of one rendered view tracked into another, against the exact motion."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
ERROR = np.array([0.004, -0.003, 0.002, 0.006, -0.005, 0.004])  # of the motion expected [m, rad]
LONG = 1.0  # s; the motion expected may be wrong by much after it


@pytest.fixture(scope='module')
def views():
    """Return a registrar, a view prepared for tracking, a keyframe, and the exact motion."""
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=16, camera=CAMERA))
    registrar = Registrar()
    keyframe, frame = source.frame(0), source.frame(3)
    poses = [source.ground_truth.at(stamp, 0.0) for stamp in (keyframe.stamp, frame.stamp)]
    tracked = registrar.prepared_for_tracking(registrar.preparer.begin(frame))
    return (registrar, tracked, registrar.prepare(keyframe), se3.inverse(poses[0]) @ poses[1])


def test_the_motion_is_found_without_keypoints_of_the_source(views):
    registrar, source, target, motion = views
    assert len(source.keypoints) == 0
    _, found = registrar.track(source, target, se3.perturbed(motion, ERROR), LONG)
    error = se3.difference(found.T_target_source, motion)
    assert found.status.ok and found.iterations == 0
    assert np.linalg.norm(error[:3]) < 0.001 and np.linalg.norm(error[3:]) < 0.001
    assert error @ np.linalg.solve(found.covariance, error) < 30.0


def test_the_source_gets_the_keypoints_where_it_sees_them(views):
    registrar, source, target, motion = views
    tracked, found = registrar.track(source, target, motion, LONG)
    rows, known = found.matches.T
    assert tracked.is_tracked and len(rows) == len(tracked.keypoints) == found.support
    expected = se3.transform(se3.inverse(motion), target.keypoints.positions[known])
    distances = np.linalg.norm(tracked.keypoints.positions[rows] - expected, axis=1)
    assert np.median(distances) < 0.003
    np.testing.assert_array_equal(tracked.keypoints.descriptors[rows],
                                  target.keypoints.descriptors[known])
    np.testing.assert_allclose(CAMERA.project(tracked.keypoints.positions.astype(float)),
                               tracked.keypoints.pixels, atol=1e-2)


def test_keypoints_of_its_own_are_those_of_a_frame_that_is_not_tracked(views):
    registrar, source, target, motion = views
    tracked, _ = registrar.track(source, target, motion, LONG)
    own, prepared = registrar.with_own_keypoints(tracked), registrar.prepare(source.frame)
    np.testing.assert_array_equal(own.keypoints.positions, prepared.keypoints.positions)
    assert not own.is_tracked


@pytest.mark.parametrize(('error', 'elapsed', 'reason'), [
    (np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0]), LONG, 'keypoints tracked from the keyframe, of'),
    (ERROR, 1e-3, 'sudden'),  # no camera is off by so much after a millisecond
])
def test_aick_has_to_decide_where_the_motion_expected_is_wrong(views, error, elapsed, reason):
    registrar, source, target, motion = views
    same, found = registrar.track(source, target, se3.perturbed(motion, error), elapsed)
    assert found.status is Status.TOO_FEW_MATCHES and reason in found.reason
    assert not same.is_tracked


def test_views_of_two_resolutions_are_not_tracked(views):
    registrar, source, target, motion = views
    small = dataclasses.replace(source, grey=source.grey[::2, ::2])
    assert not registrar.track(small, target, motion, LONG)[1].status.ok


def test_nothing_is_tracked_without_a_refinement(views):
    _, source, target, motion = views
    assert not Registrar(preset('paper-fast')).track(source, target, motion, LONG)[1].status.ok
    assert Registrar(Settings()).track(source, target, motion, LONG)[1].status.ok
