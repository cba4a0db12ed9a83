# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Records against the updates they are of."""

import dataclasses
from types import SimpleNamespace

import numpy as np

from aick_ros.evaluation.scores.frame_record import FrameRecord, is_level, stages_of, trajectory_of
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial.level import level_orientation
from aick_ros.registration.status import Status


def record(stamp=1, timing=(), x=0.0):
    return FrameRecord(stamp, Status.OK, '', PoseWithCovariance(se3.exp([x, 0, 0, 0, 0, 0])), 5, 3,
                       dict.fromkeys(timing, 1.0))


def test_each_part_is_that_of_the_update():
    update = SimpleNamespace(
        stamp=7, status=Status.MOTION_GATE, reason='too fast', pose='pose', keypoints=range(30),
        matches=range(12), timing={'total': 2.0}, increment='increment', rejected='rejected')
    made = FrameRecord.of(update)
    assert (made.stamp, made.status, made.reason) == (7, Status.MOTION_GATE, 'too fast')
    assert (made.keypoints, made.matches) == (30, 12)
    assert (made.increment, made.rejected, made.pose) == ('increment', 'rejected', 'pose')
    assert made.timing == {'total': 2.0}


def test_stages_keep_their_order_and_the_total_is_last():
    records = [record(timing=('decode', 'total', 'features')), record(timing=('total', 'views')),
               record(timing=('features', 'decode'))]
    assert stages_of(records) == ['decode', 'features', 'views', 'total']
    assert stages_of([]) == []


def test_the_trajectory_has_a_pose_of_each_frame():
    trajectory = trajectory_of([record(5, x=1.0), record(8, x=2.0)])
    assert trajectory.stamps.tolist() == [5, 8]
    np.testing.assert_array_equal(trajectory.poses[:, 0, 3], [1.0, 2.0])
    assert trajectory_of([]).poses.shape == (0, 4, 4)


def test_only_a_frame_that_begins_with_another_pose_than_the_identity_is_level():
    """What is before the first tracked frame has no pose of its own."""
    lost = dataclasses.replace(record(), status=Status.BAD_FRAME)
    assert not is_level([])
    assert not is_level([lost])
    assert not is_level([record(), record(x=1.0)])
    for up in np.r_[np.eye(3), -np.eye(3)]:  # however the camera is held
        pose = np.eye(4)
        pose[:3, :3] = level_orientation(up)
        assert is_level([lost, dataclasses.replace(record(), pose=PoseWithCovariance(pose))])
