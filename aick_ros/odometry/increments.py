# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motions from frame to frame, with the covariance of all of their errors."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.camera_clock import MAX_SCATTER
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.attempts import Attempt
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.reference import Reference, References
from aick_ros.odometry.velocity_change import VelocityChange
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.result import Registration
from aick_ros.registration.systematic_error import (
    errors_of_offset, errors_of_optics, errors_of_scale, errors_of_stamps)


class Increments:
    """
    Measures the motion since the last tracked frame by registrations of both to one keyframe.

    What both have in common cancels. What is left is noise, and by how much the motion follows a
    bias between keypoints and depth, a camera that may be misaligned, the scale of depth and
    stamps that jitter. Other sensors add their terms; after a loss it is added that the motion may
    be the one expected.

    :param misalignment: of the camera; what is not known of it is an error of each motion.
    :param bias: of increments of the camera; each one adds to what is known of it.
    :param change: of the velocity of the camera; each increment adds to what is known of it.
    :param scale_sigma: standard deviation of the scale error of depth, as a share of it.
    """

    def __init__(self, expected: ExpectedMotion, motion_model: MotionModel,
                 misalignment: MisalignmentEstimate, bias: IncrementBias,
                 change: VelocityChange, scale_sigma: float) -> None:
        self._expected, self._motion_model = expected, motion_model
        self._scale_sigma = scale_sigma
        self._misalignment, self._bias, self._change = misalignment, bias, change

    def of(self, prepared: PreparedFrame, attempt: Attempt, references: References,
           twist: np.ndarray | None) -> Increment:
        """
        Return the motion since the last tracked frame.

        Where the frame was registered neither to the keyframe nor to the depth reference, as after
        a loss, it is the motion since what it was registered to.

        :param attempt: by which the frame is tracked.
        :param references: as they were before the frame.
        :param twist: body velocity at the last tracked frame [m/s, rad/s]; None: unknown.
        """
        if attempt.reference is not (references.depth_reference or references.keyframe):
            return self._with_scale(attempt.increment)
        last = references.last
        increment = self._seen(prepared, attempt.seen, last, twist)
        if attempt.registration.is_by_depth:
            return increment  # it was registered with the expected motion as a term
        increment = self._expected.fused_increment(increment, last.stamp, prepared.stamp)
        return self._with_alternative(increment, prepared, attempt.reference, references)

    def _seen(self, prepared: PreparedFrame, seen: Registration, last: Reference,
              twist: np.ndarray | None) -> Increment:
        """Return the motion that the images alone show."""
        motion, gain = self._biased(seen, last)
        offset = errors_of_offset(motion.matrix, self._misalignment.offset_covariance, gain)
        optics = errors_of_optics(motion.matrix, self._misalignment.optics_covariance, gain,
                                  prepared.frame.camera)
        increment = Increment(motion, seconds(last.stamp, prepared.stamp))
        changes = (self._motion_model.changes_unseen(increment) if twist is None
                   else self._change.squares(increment, last.prepared, prepared, twist))
        timing = errors_of_stamps(motion.matrix, prepared, last.prepared, changes,
                                  unknown_jitter=MAX_SCATTER)
        by_readout = last.readout_error(seen)
        shutter = self._misalignment.readout_covariance * np.outer(by_readout, by_readout)
        return self._with_scale(Increment(
            motion.with_covariance(motion.covariance + offset + optics + timing + shutter),
            increment.interval))

    def _with_scale(self, increment: Increment) -> Increment:
        """Return a motion with the error of the scale of depth."""
        pose = increment.pose
        scale = errors_of_scale(pose.translation, self._scale_sigma)
        return Increment(pose.with_covariance(pose.covariance + scale), increment.interval)

    def _biased(self, seen: Registration, last: Reference
                ) -> tuple[PoseWithCovariance, np.ndarray]:
        """Return the motion with noise and bias, and by how much it follows depth, 6x6."""
        motion, shown = last.motion_to(seen)
        depth = last.prepared.scene_depth
        if seen.is_by_depth:
            motion = self._bias.add_to_depth_alone(motion, depth)
        else:
            motion = self._bias.add_to(motion, shown, depth)
        # by depth alone a motion follows depth wholly, by keypoints alone not at all
        return motion, seen.is_by_depth * np.eye(6) if shown is None else shown.gain

    def _with_alternative(self, increment: Increment, prepared: PreparedFrame,
                          reference: Reference, references: References) -> Increment:
        """Return a motion that a lost frame shows, which may be that of an object instead."""
        loss, last = references.loss, references.last
        if (loss is None or loss.twist is None or reference.stamp <= loss.last.stamp
                or not self._motion_model.holds(seconds(loss.last.stamp, prepared.stamp))):
            return increment
        alternative = self._expected.alternative_covariance(
            increment.pose.matrix, last.stamp, prepared.stamp, loss.twist)
        return Increment(increment.pose.with_covariance(increment.pose.covariance + alternative),
                         increment.interval)
