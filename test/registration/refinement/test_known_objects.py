# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is remembered of objects that move by themselves."""

import numpy as np
import pytest

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.found_objects import FoundObjects, Places
from aick_ros.registration.refinement.known_objects import KnownObjects

NOW = 50 * NANOSECONDS


def found_at(seen):
    """Return objects that have moved at a stamp."""
    source, target = (Places(np.zeros((0, 3)), np.zeros((1, 3)), seen) for _ in range(2))
    return FoundObjects(source, target)


def test_each_frame_is_known_by_its_stamp():
    found = found_at(NOW)
    known = KnownObjects()
    assert known.of(1) is None
    known.note(NOW, NOW - 1, found)
    assert known.of(NOW) is found.source and known.of(NOW - 1) is found.target
    assert known.of(NOW).seen == known.of(NOW - 1).seen == NOW


@pytest.mark.parametrize('late, is_known', [(-1, True), (0, False)])
def test_what_nothing_has_been_noted_of_since_is_forgotten_too(late, is_known):
    """As while frames are lost."""
    known = KnownObjects()
    known.note(NOW, NOW - 1, found_at(NOW))
    assert (known.of(NOW, NOW + NANOSECONDS + late) is not None) == is_known
    assert known.of(NOW) is not None


def test_what_has_moved_in_is_known_in_that_frame_alone():
    scene, objects = np.ones((2, 3)), np.full((3, 3), 2.0)
    known = KnownObjects()
    known.note_intruders(NOW, scene, objects)
    assert known.of(NOW).scene is scene and known.of(NOW).objects is objects
    assert known.of(NOW).seen == NOW and known.of(NOW - 1) is None
    known.note(NOW + NANOSECONDS, NOW + 1, None)
    assert known.of(NOW) is None


def test_what_has_moved_in_is_known_beside_what_has_moved():
    found, known = found_at(NOW - 10), KnownObjects()
    known.note(NOW, NOW - 1, found)
    known.note_intruders(NOW, np.ones((2, 3)), np.full((3, 3), 2.0))
    assert known.of(NOW).scene is found.source.scene and known.of(NOW).seen == NOW
    np.testing.assert_array_equal(known.of(NOW).objects[:, 0], [0.0, 2.0, 2.0, 2.0])
    assert known.of(NOW - 1) is found.target


def test_a_later_registration_without_objects_forgets_them():
    found = found_at(NOW)
    known = KnownObjects()
    known.note(NOW, NOW - 1, found)
    known.note(NOW + 1, NOW, None)
    assert known.of(NOW) is None and known.of(NOW + 1) is None and known.of(NOW - 1) is not None


@pytest.mark.parametrize('late, is_known', [(-1, True), (0, False)])
def test_what_has_not_moved_for_a_second_is_a_part_of_the_scene(late, is_known):
    stamp = NOW + NANOSECONDS + late
    known = KnownObjects()
    known.note(stamp, stamp - 1, found_at(NOW))
    assert (known.of(stamp) is not None) == (known.of(stamp - 1) is not None) == is_known


def test_frames_in_which_nothing_has_moved_for_a_second_are_forgotten():
    """However old they are: a keyframe is known by what was last registered to it."""
    known = KnownObjects()
    for number in range(30):
        stamp = NOW + number * NANOSECONDS // 20
        known.note(stamp, 7, found_at(stamp))
    assert [known.of(NOW + number * NANOSECONDS // 20) is not None
            for number in range(30)] == 10 * [False] + 20 * [True]
    assert known.of(7) is not None
    later = NOW + 100 * NANOSECONDS
    known.note(later, later - 1, None)
    assert known.of(7) is None


def test_the_oldest_of_many_are_forgotten():
    """Of the target and of 63 sources."""
    found = found_at(NOW)
    known = KnownObjects()
    for number in range(1, 71):
        known.note(NOW + number, NOW, found)
    assert [known.of(NOW + number) is not None for number in range(71)] == [
        True, *7 * [False], *63 * [True]]


def test_what_a_recording_has_shown_that_is_played_again_is_forgotten():
    known = KnownObjects()
    known.note(NOW, NOW - 1, found_at(NOW))
    known.note(NOW - 50, NOW - 51, None)
    assert known.of(NOW) is None and known.of(NOW - 1) is None
