# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames prepared on another thread: the answers are those without it, to the last digit."""

import dataclasses
import queue
import threading

import numpy as np
import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def frames():
    """Return frames of which some repeat images, stamps go back, and some are dark."""
    source = SyntheticSource(SyntheticOptions(seed=5, frames=16, camera=CAMERA))
    frames = [source.frame(index) for index in range(14)]
    replace = dataclasses.replace
    frames[3] = replace(frames[3], depth=frames[2].depth)
    frames[5] = replace(frames[5], colour=frames[4].colour)
    frames[7] = replace(frames[7], colour=frames[6].colour, depth=frames[6].depth)
    frames[9] = replace(frames[9], stamp=frames[8].stamp)
    frames[11] = replace(frames[11], colour=np.zeros_like(frames[11].colour),
                         depth=np.full_like(frames[11].depth, np.nan))
    return frames


def prepared_ahead(odometry, frames):
    """Yield the frames, prepared on a thread that is as far ahead as it likes."""
    waiting = queue.Queue()
    thread = threading.Thread(
        target=lambda: [waiting.put(odometry.prepare(frame)) for frame in frames])
    thread.start()
    for _ in frames:
        yield waiting.get()
    thread.join()


@pytest.mark.parametrize('changes', [
    {}, {'odometry.aick_interval': 4}, {'refinement.mode': 'keypoints'},
    {'refinement.mode': 'none', 'odometry.reference': 'previous'}])
def test_a_stream_is_answered_alike(frames, changes):
    settings = with_values(Settings(), changes)
    alone, ahead = Odometry(settings), Odometry(settings)
    expected = [alone.register_frame(frame) for frame in frames]
    found = [ahead.register(preparation) for preparation in prepared_ahead(ahead, frames)]
    assert {update.status for update in expected} >= {
        Status.FIRST_FRAME, Status.OK, Status.REPEATED, Status.BAD_STAMP}
    for update, other in zip(found, expected, strict=True):
        assert (update.stamp, update.status, update.reason, update.support) == (
            other.stamp, other.status, other.reason, other.support)
        np.testing.assert_array_equal(update.pose.matrix, other.pose.matrix)
        np.testing.assert_array_equal(update.pose.covariance, other.pose.covariance)
        np.testing.assert_array_equal(update.keypoints.pixels, other.keypoints.pixels)


def test_what_was_prepared_with_other_settings_is_prepared_again(frames):
    odometry = Odometry()
    odometry.register_frame(frames[0])
    ahead = odometry.prepare(frames[1])
    assert len(ahead.keypoints()) > 50
    odometry.change_settings(with_values(Settings(), {'features.max_keypoints': 50}))
    assert len(odometry.register(ahead).keypoints) == 50


def test_the_time_of_preparation_is_that_of_its_frame(frames):
    odometry = Odometry()
    first, second = (odometry.prepare(frame) for frame in frames[:2])
    assert second.times.take()['features'] > 0.0  # and now it has none
    assert odometry.register(first).timing['features'] > 0.0
    assert odometry.register(second).timing['features'] == 0.0


def test_keypoints_that_may_not_be_needed_are_not_made_ahead(frames):
    settings = with_values(Settings(), {'odometry.aick_interval': 4})
    times = Odometry(settings).prepare(frames[0]).times.take()
    assert times['features'] == 0.0 and times['surface'] > 0.0
