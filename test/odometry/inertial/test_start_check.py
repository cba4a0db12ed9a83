# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A level start that is doubted until a motion has agreed with it for long."""

import pytest

from aick_ros.odometry.inertial.start_check import StartCheck


def noted(*frames):
    """Return a check after frames, each suspicion and whether what is up is shown."""
    check = StartCheck()
    for suspicion, is_shown in frames:
        check.note(suspicion, is_shown)
    return check


def test_the_largest_doubt_remains():
    assert [noted(*((each, True) for each in suspicions)).doubt for suspicions in (
        (), (0.0,), (0.2, 0.6, 0.3, 0.0), (1.0, 0.0))] == [0.0, 0.0, 0.6, 1.0]


@pytest.mark.parametrize('frames, doubt', [
    ([(0.4, True)] + 89 * [(0.0, True)], 0.4),
    ([(0.4, True)] + 90 * [(0.0, True)], 0.0),
    ([(0.4, True)] + 500 * [(0.0, False)], 0.4),
    ([(0.4, True)] + 80 * [(0.0, True)] + [(0.1, True)] + 80 * [(0.0, True)], 0.4)],
    ids=['not for long', 'for long', 'at rest', 'with a contradiction'])
def test_a_motion_that_agrees_for_ninety_frames_ends_it(frames, doubt):
    assert noted(*frames).doubt == doubt


def test_a_start_that_was_confirmed_is_doubted_no_more():
    assert noted(*90 * [(0.0, True)], (1.0, True)).doubt == 0.0


def test_another_start_is_checked_anew_and_the_doubt_of_its_sensor_remains():
    check = noted(*90 * [(0.0, True)])
    check.restart()
    check.note(0.7, True)
    check.restart()
    assert check.doubt == 0.7
