# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracks from a first pose that serve for a check of the same pair too."""

import dataclasses
import pickle
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.first_tracks import FirstTracks
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SETTINGS = Settings()
CHOSEN = np.arange(1, 300, 3)


@pytest.fixture(scope='module')
def pair():
    """Return two prepared frames, and a pose that is turned as far as images are turned."""
    source, registrar = SyntheticSource(SyntheticOptions(seed=5, frames=5)), Registrar()
    views = [registrar.prepare(source.frame(i)) for i in (0, 4)]
    poses = source.ground_truth.poses
    return views[1], views[0], (se3.inverse(poses[0]) @ poses[4]
                                @ se3.exp([0, 0, 0, 0, 0, np.radians(2.0)]))


@pytest.fixture
def tracker():
    return Tracker(SETTINGS.refinement, SETTINGS.sensor)


def test_the_tracks_of_some_are_those_that_they_have_alone(pair, tracker):
    first = FirstTracks(tracker, SETTINGS.refinement.max_tracks)
    every = first.of(*pair)
    some = first.of_some(*pair, CHOSEN)
    source, target, pose = pair
    few = dataclasses.replace(source, keypoints=source.keypoints[CHOSEN])
    alone = tracker.track(few, target, pose)
    assert 20 < len(some) < len(every)
    for name in ('keypoints', 'points', 'rays', 'depths', 'sigmas'):
        np.testing.assert_allclose(getattr(some, name), getattr(alone, name), rtol=1e-12)


def counted(most=100):
    """Return first tracks by a tracker that counts, and its count."""
    asked = []
    tracks = SimpleNamespace(track=lambda *_: asked.append('tracks') or SimpleNamespace())
    return FirstTracks(tracks, most), asked


def test_nothing_is_known_of_another_pair_or_another_pose(pair, made):
    source, target, other = (made.prepared(stamp) for stamp in (3, 2, 1))
    pose = made.pose()
    first, asked = counted()
    first.of(source, other, pose)
    first.of(source, target, made.pose())
    assert first.of_some(source, target, pose, CHOSEN) is None
    assert first.of_some(other, target, pose, CHOSEN) is None
    assert len(asked) == 2


def test_a_pose_is_known_by_its_numbers(pair, tracker):
    source, target, pose = pair
    first, begun = FirstTracks(tracker, 400), pose.copy()
    first.of(source, target, begun)
    begun[0, 3] += 0.01
    assert first.of_some(source, target, pose.copy(), CHOSEN) is not None
    assert first.of_some(source, target, begun, CHOSEN) is None


def test_frames_of_two_cameras_are_not_taken_for_one_another_by_their_stamps(made):
    source, target, other = (made.prepared(stamp) for stamp in (3, 2, 2))
    first, _ = counted()
    pose = made.pose()
    first.of(source, other, pose)
    assert first.of_some(source, target, pose, CHOSEN) is None
    assert first.of_some(made.prepared(3), other, pose, CHOSEN) is None


def test_frames_are_not_kept_for_their_tracks(made):
    source, target = made.prepared(3), made.prepared(2)
    first, _ = counted()
    first.of(source, target, made.pose())
    kept = [weakref.ref(frame) for frame in (source, target)]
    del source, target
    assert [reference() for reference in kept] == [None, None]


def test_nothing_is_known_of_keypoints_beyond_the_most(pair, tracker):
    source, target, pose = pair
    for most, is_known in ((len(source.keypoints), True), (len(source.keypoints) - 1, False)):
        first = FirstTracks(tracker, most)
        first.of(source, target, pose)
        assert (first.of_some(source, target, pose, CHOSEN) is not None) == is_known


def test_the_last_source_alone_is_known_and_it_can_be_pickled(pair, tracker):
    source, target, pose = pair
    first = FirstTracks(tracker, 400)
    first.of(source, target, pose)
    copy = pickle.loads(pickle.dumps(first))
    assert copy.of_some(source, target, pose, CHOSEN) is None
    first.of(dataclasses.replace(source), target, pose)
    assert first.of_some(source, target, pose, CHOSEN) is None
