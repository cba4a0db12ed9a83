# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The frame that rotations are compared from: the keyframe, or a later one."""

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.recent_reference import RecentReference

VARIANCE = 1e-6


def at(time):
    """Return where a camera that turns evenly is seen from its keyframe at a time [s]."""
    return PoseWithCovariance(se3.exp([0.0, 0.0, 0.01 * time, 0.0, 0.02 * time, 0.0]),
                              VARIANCE * np.eye(6))


def references(keyframe_at):
    """Return time, stamp of the reference [s] and motion, of each frame in 60 s."""
    reference, rows = RecentReference(), []
    for time in range(1, 61):
        keyframe = keyframe_at(time)
        stamp, motion = reference.motion(keyframe * NANOSECONDS, time * NANOSECONDS,
                                         at(time - keyframe))
        rows.append((time, stamp / NANOSECONDS, motion))
    return rows


def test_it_is_the_keyframe_for_twenty_seconds_then_the_last_frame_before():
    stamps = [stamp for _, stamp, _ in references(lambda time: 0)]
    assert stamps == [0] * 21 + [21] * 21 + [42] * 18


def test_the_motion_is_that_since_the_reference():
    for time, stamp, motion in references(lambda time: 0):
        expected = at(time - stamp).matrix
        np.testing.assert_allclose(motion.matrix, expected, atol=1e-9)
        variances = np.diag(motion.covariance)[3:]
        np.testing.assert_allclose(variances, VARIANCE * (1 if stamp == 0 else 2), rtol=1e-6)


def test_a_new_keyframe_is_the_reference():
    for time, stamp, motion in references(lambda time: (time - 1) // 10 * 10):
        assert time - stamp <= 10
        assert motion.covariance[3, 3] < 1.01 * VARIANCE
