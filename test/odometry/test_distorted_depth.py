# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera whose depth images are distorted: measured while it moves, and corrected."""

import dataclasses
import functools

import numpy as np
import pytest

from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.depth_distortion import COLUMNS, ROWS, DepthDistortion
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.registration.refinement.distortion_estimate import DistortionEstimate
from aick_ros.registration.status import Status
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT = 85
DISTORTION = DepthDistortion(np.random.default_rng(3).normal(0.0, 0.004, (ROWS, COLUMNS)))


@functools.cache
def source():
    return SyntheticSource(SyntheticOptions(
        seed=81, frames=COUNT, rate=30.0, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5)))


@functools.cache
def frames():
    """Return frames of a camera whose inverse depth lacks the distortion."""
    distorts = DepthDistortion(-DISTORTION.nodes)
    return [dataclasses.replace(frame, depth=distorts.undistorted(frame.depth))
            for frame in source().frames()]


def followed(odometry):
    """Return the updates of all frames, and the root mean square error of the path [m]."""
    updates = [odometry.register_frame(frame) for frame in frames()]
    path = Trajectory(np.array([update.stamp for update in updates]),
                      np.array([update.T_odom_camera for update in updates]))
    errors = compare(path, source().ground_truth).positions()
    return updates, float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope='module')
def learned():
    """Return an odometry that has seen all frames, with its updates and error."""
    odometry = Odometry()
    return odometry, *followed(odometry)


def test_it_is_found(learned):
    odometry, _, _ = learned
    found = odometry.distortion.nodes
    assert np.corrcoef(found.ravel(), DISTORTION.nodes.ravel())[0, 1] > 0.8
    assert 0.3 < odometry.distortion.rms / DISTORTION.rms < 1.1


def test_the_path_is_nearer_to_the_truth_once_it_is_known(learned, monkeypatch):
    odometry, _, error = learned
    odometry.reset()
    assert not odometry.distortion.is_none
    _, later = followed(odometry)
    monkeypatch.setattr(DistortionEstimate, 'learn', lambda *_: None)
    _, uncorrected = followed(Odometry())
    assert later < 0.7 * uncorrected
    assert error < 1.2 * uncorrected  # corrected from the middle of the path on


def test_frames_are_registered_without_the_distortion(learned):
    _, updates, _ = learned
    first, last, images = updates[0].prepared, updates[-1].prepared, frames()
    np.testing.assert_array_equal(first.frame.depth, images[0].depth)
    true = source().frame(COUNT - 1).depth
    errors = [np.abs(1 / image - 1 / true)[np.isfinite(true)].mean()
              for image in (last.frame.depth, images[-1].depth)]
    assert errors[0] < 0.75 * errors[1]
    expected = last.frame.camera.back_project(
        last.keypoints.pixels.astype(float), last.keypoints.positions[:, 2].astype(float))
    np.testing.assert_allclose(last.keypoints.positions, expected, rtol=1e-5, atol=1e-5)


def test_frames_that_are_prepared_ahead_are_answered_alike(learned):
    """However many of them were prepared before the distortion was known."""
    _, expected, _ = learned
    odometry = Odometry()
    ahead = [odometry.prepare(frame) for frame in frames()[:60]]
    found = [odometry.register(preparation) for preparation in ahead]
    assert not odometry.distortion.is_none
    for update, other in zip(found, expected):
        np.testing.assert_array_equal(update.pose.matrix, other.pose.matrix)
        np.testing.assert_array_equal(update.pose.covariance, other.pose.covariance)


def test_a_change_of_settings_keeps_it(learned):
    odometry, _, _ = learned
    known = odometry.distortion
    odometry.change_settings(odometry._settings)
    update = odometry.register_frame(dataclasses.replace(
        frames()[0], stamp=frames()[-1].stamp + 2_000_000_000))
    assert update.prepared.distortion is known is odometry.distortion


def test_the_keyframe_is_brought_to_it_once_when_it_is_known():
    """Rather than kept as it was, and brought to it beside itself."""
    odometry = Odometry()
    # from the fourth frame on it becomes known when the keyframe is some frames old
    moved = next(update for update in map(odometry.register_frame, frames()[3:])
                 if not update.prepared.distortion.is_none)
    keyframe = odometry._references.keyframe
    assert keyframe.stamp < moved.stamp
    assert keyframe.prepared.distortion == moved.prepared.distortion


def test_images_that_repeat_are_recognized_before_and_after_it_is_known():
    """Also where one of the two frames was prepared before, and the other one after."""
    odometry = Odometry()
    again = [dataclasses.replace(frame, stamp=frame.stamp + 1) for frame in frames()[:60]]
    ahead = [odometry.prepare(frame) for frame in again]
    known = next(index for index, frame in enumerate(frames())
                 if not (odometry.register_frame(frame) and odometry.distortion.is_none))
    assert odometry.register_frame(again[known]).status is Status.REPEATED
    later = odometry.register_frame(frames()[known + 1])
    assert not later.prepared.distortion.is_none and ahead[known + 1].distortion.is_none
    assert odometry.register(ahead[known + 1]).status is Status.REPEATED
