# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A sensor that contradicts another one: suspected, then wrong, then right again."""

from aick_ros.odometry.inertial.disagreement import Disagreement


def test_it_is_suspected_before_it_is_wrong_and_until_it_is_right():
    found, states = Disagreement(10.0, 0.3, 0.15), []
    for agrees in (True, False, False, False, False, *[True] * 7):
        found.note(agrees)
        states.append((found.is_suspected, found.is_wrong))
    # shares of 0, 0.1, 0.19, 0.27, 0.34, then nine tenths of the one before
    assert states[:5] == [(False, False), (False, False), (True, False), (True, False),
                          (True, True)]
    assert states[5:] == [(True, True)] * 7
    found.note(True)
    assert not found.is_suspected and not found.is_wrong
