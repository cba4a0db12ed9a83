# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odometry that tracks from the keyframe between registrations by AICK."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.odometry.reference import Reference
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=16, camera=CAMERA))
    frames = [source.frame(index) for index in range(12)]
    return frames, [source.ground_truth.at(frame.stamp, 0.0) for frame in frames]


def every(interval):
    return Odometry(with_values(Settings(), {'odometry.aick_interval': interval}))


def test_aick_checks_every_fourth_frame_and_the_path_is_right(frames, monkeypatch):
    images, truth = frames
    odometry, checked = every(4), []
    contradicts = Registrar.contradicts
    monkeypatch.setattr(KeyframeChoice, 'replaces', lambda *of: False)  # they are checked, too
    monkeypatch.setattr(Registrar, 'contradicts', lambda self, own, *of: (
        checked.append(own.stamp) or contradicts(self, own, *of)))
    updates = [odometry.register_frame(frame) for frame in images]
    assert all(update.status.ok for update in updates)
    # the first has no reference, the second no velocity to expect anything by
    assert all(update.prepared.is_tracked for update in updates[2:])
    assert checked == [images[5].stamp, images[9].stamp]
    for update, pose in zip(updates, truth):
        error = se3.difference(update.T_odom_camera, se3.inverse(truth[0]) @ pose)
        assert np.linalg.norm(error[:3]) < 0.004 and np.linalg.norm(error[3:]) < 0.004


def test_by_default_aick_registers_every_frame(frames):
    odometry = every(1)
    assert not any(odometry.register_frame(frame).prepared.is_tracked for frame in frames[0][:4])


def test_a_keyframe_has_keypoints_of_its_own(frames):
    odometry = Odometry(with_values(Settings(), {
        'odometry.aick_interval': 100, 'odometry.min_overlap': 1.0}))  # each one is a keyframe
    for frame in frames[0][:4]:
        update = odometry.register_frame(frame)
    reference = odometry.register_frame(frames[0][4]).reference
    assert update.prepared.is_tracked and update.matches[:, 0].max() < len(update.keypoints)
    assert len(reference) > len(update.keypoints)  # all that the keyframe shows


def test_what_cannot_be_tracked_is_lost_and_found_as_ever(frames):
    images, _ = frames
    odometry = every(100)
    for frame in images[:4]:
        odometry.register_frame(frame)
    dark = dataclasses.replace(images[4], colour=np.zeros_like(images[4].colour),
                               depth=np.full_like(images[4].depth, np.nan))
    assert not odometry.register_frame(dark).status.ok
    found = odometry.register_frame(images[5])
    assert found.status is Status.OK and found.recovered and not found.prepared.is_tracked


def test_a_stamp_that_repeats_is_answered_as_ever(frames):
    odometry = every(100)
    for frame in frames[0][:4]:
        odometry.register_frame(frame)
    again = dataclasses.replace(frames[0][5], stamp=frames[0][3].stamp)
    assert odometry.register_frame(again).status is Status.BAD_STAMP


@pytest.mark.parametrize('back', [1, 1_000_000])
def test_a_stamp_before_that_of_an_image_that_repeats_is_answered_as_ever(frames, back):
    odometry = every(100)
    for frame in frames[0][:4]:
        odometry.register_frame(frame)
    repeated = dataclasses.replace(frames[0][3], stamp=frames[0][3].stamp + 30_000_000)
    assert odometry.register_frame(repeated).status is Status.REPEATED
    late = dataclasses.replace(frames[0][4], stamp=repeated.stamp - back)
    assert odometry.register_frame(late).status is Status.BAD_STAMP
    assert odometry.register_frame(frames[0][5]).status is Status.OK


def test_a_search_waits_for_frames_that_are_registered_in_the_shortest_way(frames, monkeypatch):
    """That is by tracking where AICK registers only some; by AICK where it registers all."""
    for interval in (1, 4):
        easy = []
        monkeypatch.setattr(KeyframeMemory, 'track', lambda self, *args: easy.append(
            args[4] is Effort.LEAST))
        odometry = every(interval)
        updates = [odometry.register_frame(frame) for frame in frames[0]]
        tracked = [update.prepared.is_tracked for update in updates[1:]]
        assert easy == ([True] * len(tracked) if interval == 1 else tracked)
        assert any(easy)


def test_a_search_waits_while_frames_are_registered_to_others_than_the_keyframe(
        frames, monkeypatch):
    """The last frame, where the keyframe is of another place."""
    easy = []
    monkeypatch.setattr(KeyframeMemory, 'track', lambda self, *args: easy.append(
            args[4] is Effort.LEAST))
    odometry = every(1)
    for frame in frames[0][:3]:
        odometry.register_frame(frame)
    references = odometry._references
    dark = dataclasses.replace(frames[0][0], colour=np.zeros_like(frames[0][0].colour))
    references.keyframe = Reference(Registrar().prepare(dark), references.keyframe.pose)
    assert odometry.register_frame(frames[0][3]).status.ok
    assert easy[-2:] == [True, False]
