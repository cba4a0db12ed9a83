# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is handed over with an update belongs to who gets it."""

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.status import Status


def prepared():
    frame = RgbdFrame(7, np.zeros((3, 4), np.uint8), np.ones((3, 4), np.float32),
                      Camera(4, 3, 4.0, 4.0, 1.5, 1.0))
    return PreparedFrame(frame, KeypointFrame.none(7), frame.grey)


def motion(x):
    return Increment(PoseWithCovariance(se3.exp([x, 0, 0, 0, 0, 0]), x * np.eye(6)), x)


def arrays(update):
    """Return all arrays of an update that may be changed."""
    poses = [update.pose, *(getattr(update, name).pose for name in (
        'increment', 'expected', 'rejected') if getattr(update, name) is not None)]
    return [update.matches, *(part for pose in poses for part in (pose.matrix, pose.covariance)),
            *([] if update.level_start is None else [update.level_start])]


def full():
    return OdometryUpdate(
        7, Status.OK, 'fine', motion(0.5).pose, prepared(), motion(1.0), motion(2.0), motion(3.0),
        matches=np.array([[1, 2], [3, 4]]), support=9, recovered=True,
        level_start=se3.exp([1, 2, 3, 0, 0, 0]), timing={'old': 1.0})


def test_all_is_the_same_but_the_time_it_took():
    update, timing = full(), {'total': 3.0}
    handed = update.handed_over(timing)
    for one, other in zip(arrays(handed), arrays(update), strict=True):
        np.testing.assert_array_equal(one, other)
    assert handed.timing == timing and update.timing == {'old': 1.0}
    for name in ('stamp', 'status', 'reason', 'support', 'recovered', 'prepared'):
        assert getattr(handed, name) is getattr(update, name)
    for name, interval in (('increment', 1.0), ('expected', 2.0), ('rejected', 3.0)):
        assert getattr(handed, name).interval == interval


def test_its_owner_may_change_it():
    update = full()
    before = [array.copy() for array in arrays(update)]
    for array in arrays(update.handed_over({})):
        array += 5
    for array, kept in zip(arrays(update), before, strict=True):
        np.testing.assert_array_equal(array, kept)


def test_what_is_not_there_stays_so():
    update = OdometryUpdate(7, Status.FIRST_FRAME, '', motion(1.0).pose, prepared())
    handed = update.handed_over({})
    assert handed.increment is handed.expected is handed.rejected is handed.level_start is None
    assert handed.matches.shape == (0, 2)


def test_pose_and_keypoints_are_those_of_its_parts():
    update = full()
    assert update.T_odom_camera is update.pose.matrix
    assert update.keypoints is update.prepared.keypoints
