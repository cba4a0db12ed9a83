# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses that are kept level, without a jump (REP-105)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.kalman import KalmanUpdate, propagated
from aick_ros.geometry.pose import PoseWithCovariance

UP = np.array([0.0, 0.0, 1.0])
"""The direction of z in a level frame, 3; by definition."""

_POSITION, _TILT = np.eye(3, 6), np.eye(2, 6, 3)  # by definition: rotations about x and y
_TILT_BY_UP = se3.skew(UP)[:2]  # derivative of these by the direction

_TIME = 3.0  # s; chosen: the direction of gravity changes by less than noise meanwhile
_MAX_TURN = 0.0017  # rad; chosen: a tenth of a degree per frame is no jump

_SHARE_OF_NOISE = 0.5
"""Largest correction per second, by the standard deviation of the orientation of one frame.

Chosen on two excerpts of real recordings and simulated drift: relative errors over one second do
not grow, and with 1.0 the start is level no more than twice as soon."""

_SETTLED = 20.0
"""Time from which on it is corrected so fast [s]; before, slower in proportion to the time.

Chosen on rendered rooms: at first a pose is taken to be far less certain than it is, and a start
that is tilted can wait."""


@dataclass(frozen=True, eq=False)
class Direction:
    """
    A direction, 3, of length one.

    :param covariance: 3x3, of its error [rad^2].
    """

    vector: np.ndarray
    covariance: np.ndarray

    def in_axes(self, rotation: np.ndarray) -> Direction:
        """Return it in other axes, by the rotation into them, 3x3."""
        return Direction(rotation @ self.vector, rotation @ self.covariance @ rotation.T)


class Level:
    """
    Transform to a frame in which z points up, from one that has drifted.

    It turns slowly, about the camera, so that neither its position nor its motion jumps.
    """

    def __init__(self) -> None:
        self._T_level_drifted = np.eye(4)
        self._noise: np.ndarray | None = None  # covariance of roll and pitch by gravity
        self._left = np.zeros(2)  # error of roll and pitch that is not corrected yet
        self._age = 0.0  # s

    def apply(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """
        Return a pose in the level frame.

        Roll and pitch are as uncertain as gravity leaves them, and by what is not corrected yet.
        """
        matrix: np.ndarray = self._T_level_drifted @ pose.matrix
        if self._noise is None:
            return PoseWithCovariance(matrix, pose.covariance)
        update = KalmanUpdate.of(pose.covariance, _TILT, self._noise)
        gain, kept = update.gain, update.kept
        gain[:3], kept[:3] = 0.0, _POSITION  # positions stay where they are
        error = self._noise + np.outer(self._left, self._left)
        return PoseWithCovariance(matrix, propagated(kept, pose.covariance, gain, error))

    def approach(self, up: Direction, pose: PoseWithCovariance, elapsed: float) -> None:
        """
        Turn the frame towards the level one, by less than orientations err by.

        The error is corrected as far as it exceeds the uncertainty of gravity: what that changes
        by would be added to the motion.

        :param up: in the frame that has drifted.
        :param pose: ``T_drifted_camera``, with the covariance of one measurement.
        :param elapsed: time since the last step [s].
        """
        seen = up.in_axes(self._T_level_drifted[:3, :3])
        error = se3.rotation_between(seen.vector, UP)
        self._noise = _TILT_BY_UP @ seen.covariance @ _TILT_BY_UP.T
        angle = max(math.hypot(*error), 1e-12)
        uncertain = math.sqrt(error[:2] @ self._noise @ error[:2]) / angle
        sigma = math.sqrt(pose.covariance[3:, 3:].trace() / 3)
        self._age += elapsed
        share = _SHARE_OF_NOISE * min(self._age / _SETTLED, 1.0)
        largest = min(share * sigma * elapsed, _MAX_TURN)
        significant = min(elapsed / _TIME, 1.0) * max(angle - uncertain, 0.0)
        step = min(significant, largest) / angle * error
        levelled = se3.perturbed(self._T_level_drifted @ pose.matrix,
                                 np.concatenate([np.zeros(3), step]))
        self._T_level_drifted = levelled @ se3.inverse(pose.matrix)
        self._left = (error - step)[:2]


def level_orientation(up: np.ndarray) -> np.ndarray:
    """
    Return the orientation ``R_level_camera`` of an optical frame, by what is up in it, 3x3.

    A camera that looks ahead looks along x; any other is turned from there by the least angle.
    """
    ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    orientation: np.ndarray = se3.exp_rotation(se3.rotation_between(ahead @ up, UP)) @ ahead
    return orientation
