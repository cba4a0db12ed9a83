# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames whose images are those of the frame before."""

from __future__ import annotations

import dataclasses

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.odometry.velocity import Velocity
from aick_ros.registration.refinement.measured_noise import MeasuredNoise


class RepeatedImages:
    """
    What frames show whose images are those of the frame before: rest, or nothing.

    A sensor at rest has noise, a simulated one may have none: its images that do not change for
    longer than the camera needs to stop (``odometry.hold_time`` and the time by
    ``odometry.acceleration_sigma``) are taken for rest, unless another sensor moves. Others are no
    measurement: the motion is that of the motion model or of another sensor.

    :param noise: of the camera: where it is seen no image shows rest.
    """

    def __init__(self, motion_model: MotionModel, expected: ExpectedMotion,
                 other: OtherOdometry, noise: MeasuredNoise) -> None:
        self._motion_model, self._expected, self._other = motion_model, expected, other
        self._noise = noise

    def show_rest(self, start: int, end: int, velocity: Velocity, last: int) -> bool:
        """
        Return whether the camera is at rest where images do not change between two stamps [ns].

        :param velocity: before that.
        :param last: stamp of the last frame whose pose was measured [ns].
        """
        if (self._noise.is_seen
                or seconds(start, end) <= self._motion_model.time_to_rest(velocity.twist)
                or self._expected.is_moving(start, end) or self._expected.is_moving(last, end)):
            return False
        moved = self._other.motion(start, end)
        return moved is None or self._other.is_at_rest(moved)

    def motion(self, start: int, end: int, velocity: Velocity) -> Increment:
        """Return the motion that is expected between two stamps [ns], from a velocity on."""
        elapsed = seconds(start, end)
        motion = self._expected.without_images(start, end, velocity.twist)
        if not self._expected.is_measured(start, end, velocity.twist):
            motion = motion.with_covariance(
                motion.covariance + elapsed ** 2 * velocity.covariance)
        return Increment(motion, elapsed)


def repeated(prepared: PreparedFrame, frame: RgbdFrame) -> PreparedFrame:
    """Return a prepared frame at the stamp of another one that has the same images."""
    return dataclasses.replace(
        prepared, repeat=Repeat.BOTH,
        frame=dataclasses.replace(prepared.frame, stamp=frame.stamp, colour=frame.colour,
                                  camera=frame.camera, depth_stamp=frame.depth_stamp,
                                  imu=frame.imu),
        keypoints=dataclasses.replace(prepared.keypoints, stamp=frame.stamp))
