# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of objects that move by themselves."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.refinement.known_objects import FoundObjects, KnownObjects
from aick_ros.registration.refinement.object_places import seen_by_target
from aick_ros.registration.refinement.tracks import Tracks

POSE = se3.exp([0.1, -0.05, 0.02, 0.02, 0.05, -0.01])
NOW = 50 * NANOSECONDS


def tracks_at(points, moved=np.zeros(3)):
    """Return tracks of points of which the target measures where they have moved to."""
    seen = se3.transform(POSE, points + moved)
    return Tracks(np.arange(len(points)), points, seen[:, :2] / seen[:, 2:], seen[:, 2].copy(),
                  np.full(len(points), 0.01))


@pytest.fixture
def scene_and_objects():
    rng = np.random.default_rng(4)
    return (tracks_at(rng.uniform([-1, -1, 2], [1, 1, 3], (30, 3))),
            tracks_at(rng.uniform([-0.2, -0.2, 1], [0.2, 0.2, 1.2], (20, 3)),
                      np.array([0.05, 0.0, -0.1])))


def test_both_frames_see_them_where_they_are(scene_and_objects):
    """An object has moved, so the target sees it where the pose of the scene does not put it."""
    scene, objects = scene_and_objects
    found = FoundObjects.of(scene, objects, POSE, NOW)
    assert found.source.scene is scene.points and found.source.objects is objects.points
    np.testing.assert_allclose(found.target.scene, se3.transform(POSE, scene.points), atol=1e-9)
    np.testing.assert_allclose(found.target.objects, se3.transform(
        POSE, objects.points + [0.05, 0.0, -0.1]), atol=1e-9)
    assert found.source.seen == found.target.seen == NOW


def test_a_track_without_depth_is_as_far_as_the_pose_puts_it(scene_and_objects):
    scene, _ = scene_and_objects
    exact = seen_by_target(scene, POSE)
    scene.depths[::2] = np.nan
    np.testing.assert_allclose(seen_by_target(scene, POSE), exact, atol=1e-9)


def test_each_frame_is_known_by_its_stamp(scene_and_objects):
    found = FoundObjects.of(*scene_and_objects, POSE, NOW)
    known = KnownObjects()
    assert known.of(1) is None
    known.note(NOW, NOW - 1, found)
    assert known.of(NOW) is found.source and known.of(NOW - 1) is found.target
    assert known.of(NOW).seen == known.of(NOW - 1).seen == NOW


def test_a_later_registration_without_objects_forgets_them(scene_and_objects):
    found = FoundObjects.of(*scene_and_objects, POSE, NOW)
    known = KnownObjects()
    known.note(NOW, NOW - 1, found)
    known.note(NOW + 1, NOW, None)
    assert known.of(NOW) is None and known.of(NOW + 1) is None and known.of(NOW - 1) is not None


@pytest.mark.parametrize('late, is_known', [(-1, True), (0, False)])
def test_what_has_not_moved_for_a_second_is_a_part_of_the_scene(scene_and_objects, late, is_known):
    stamp = NOW + NANOSECONDS + late
    known = KnownObjects()
    known.note(stamp, stamp - 1, FoundObjects.of(*scene_and_objects, POSE, NOW))
    assert (known.of(stamp) is not None) == (known.of(stamp - 1) is not None) == is_known


def test_frames_in_which_nothing_has_moved_for_a_second_are_forgotten(scene_and_objects):
    """However old they are: a keyframe is known by what was last registered to it."""
    known = KnownObjects()
    for number in range(30):
        stamp = NOW + number * NANOSECONDS // 20
        known.note(stamp, 7, FoundObjects.of(*scene_and_objects, POSE, stamp))
    assert [known.of(NOW + number * NANOSECONDS // 20) is not None
            for number in range(30)] == 10 * [False] + 20 * [True]
    assert known.of(7) is not None
    later = NOW + 100 * NANOSECONDS
    known.note(later, later - 1, None)
    assert known.of(7) is None


def test_the_oldest_of_many_are_forgotten(scene_and_objects):
    """Of the target and of 63 sources."""
    found = FoundObjects.of(*scene_and_objects, POSE, NOW)
    known = KnownObjects()
    for number in range(1, 71):
        known.note(NOW + number, NOW, found)
    assert [known.of(NOW + number) is not None for number in range(71)] == [
        True, *7 * [False], *63 * [True]]


def test_what_a_recording_has_shown_that_is_played_again_is_forgotten(scene_and_objects):
    known = KnownObjects()
    known.note(NOW, NOW - 1, FoundObjects.of(*scene_and_objects, POSE, NOW))
    known.note(NOW - 50, NOW - 51, None)
    assert known.of(NOW) is None and known.of(NOW - 1) is None
