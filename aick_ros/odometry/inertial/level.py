# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses that are kept level, without a jump (REP-105)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import definite, se3
from aick_ros.geometry.pose import PoseWithCovariance, at_point

UP = np.array([0.0, 0.0, 1.0])
"""The direction of z in a level frame, 3; by definition."""

_TILT = slice(3, 5)  # by definition: rotations about x and y
_TILT_BY_UP = se3.skew(UP)[:2]  # derivative of these by the direction

_TIME = 1.0  # s; chosen: the direction of gravity changes by less than noise meanwhile

_FASTEST = 0.0001
"""Largest turn per second [rad].

Chosen on rendered rooms: a turn bends the path. At a degree per second a start that is tilted by
7 deg is level within ten seconds, but the path errs by seven times as much, and rotations over one
second by twenty times; at 0.006 deg per second neither errs by more in 20 s, and a
start that is 2.4 deg off is level after seven minutes."""

_UNKNOWN_TILT = np.eye(2)
"""Covariance of roll and pitch by an accelerometer that the camera contradicts [rad^2].

Derived: of a direction at random, which is off by 0 to 180 deg, they are a radian or more."""


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


@dataclass(frozen=True, eq=False)
class Turn:
    """
    Turn of the frame of the odometry, about the first pose in it, by which it begins level.

    Or, where what is up turns out to be unknown, as without an accelerometer.

    :param T_level_odom: 4x4.
    :param position: of the first pose, 3 [m].
    :param before: 2x2, covariance of its roll and pitch before the turn [rad^2].
    :param after: 2x2, the same after it.
    :param is_level: whether it begins level.
    """

    T_level_odom: np.ndarray
    position: np.ndarray
    before: np.ndarray
    after: np.ndarray
    is_level: bool = True

    def apply(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose of the odometry in the frame; since the start it was not levelled."""
        since_start = definite.nonnegative(
            pose.covariance - self._by_tilt(pose.translation, self.before))
        turned: PoseWithCovariance = self.T_level_odom @ pose.with_covariance(since_start)
        return turned.with_covariance(
            turned.covariance + self._by_tilt(turned.translation, self.after))

    def _by_tilt(self, position: np.ndarray, tilt: np.ndarray) -> np.ndarray:
        """Return the covariance of a pose at a position, 6x6, by that of the tilt, 2x2."""
        by_tilt = at_point(position - self.position)[:, _TILT]
        covariance: np.ndarray = by_tilt @ tilt @ by_tilt.T
        return covariance


class Level:
    """
    Transform to a frame in which z points up, from one that has drifted.

    It turns slowly, about the camera, so that neither its position nor its motion jumps. What is
    known of the tilt but not corrected yet is part of the covariance, and so are the positions
    that were reached with it.
    """

    def __init__(self) -> None:
        self._T_level_drifted = np.eye(4)
        self._T_drifted_given: np.ndarray | None = None  # by :meth:`begin_anew`
        self._start: tuple[np.ndarray, np.ndarray] | None = None
        self._noise: np.ndarray | None = None  # covariance of roll and pitch by gravity
        self._error, self._left = np.zeros((2, 2))  # of them, in all and not corrected yet
        self._before = np.zeros((2, 2))  # their covariance since the start meanwhile

    def begin(self, position: np.ndarray, variance: float) -> None:
        """
        Begin with a first pose whose covariance is without the error of its tilt.

        :param position: of the camera there, 3 [m].
        :param variance: of roll and of pitch [rad^2].
        """
        self._start = position.copy(), variance * np.eye(2)

    def begin_anew(self, T_level_odom: np.ndarray, up: Direction,
                   pose: PoseWithCovariance) -> Turn:
        """
        Let the first pose have been level by what is known of gravity now.

        :param T_level_odom: turn about the position of that pose, 4x4.
        :param up: in the frame as it is so far, which :meth:`approach` has not turned.
        :param pose: of the camera now there, with its covariance since the start.
        """
        assert self._start is not None  # by :meth:`begin`
        position, before = self._start
        self._T_drifted_given = T_level_odom
        drifted, seen = T_level_odom @ pose, up.in_axes(T_level_odom[:3, :3])
        self._noise = _TILT_BY_UP @ seen.covariance @ _TILT_BY_UP.T
        # the pose has drifted since the start: by as much the start is less certain than now
        self._start = position, self._noise + drifted.covariance[_TILT, _TILT]
        self._before = self._since_level(drifted, self._start).covariance[_TILT, _TILT]
        return Turn(T_level_odom, position, before, self._start[1])

    def give_up(self, T_first_odom: np.ndarray) -> Turn:
        """
        Let the first pose have been no level one, as what is up is not known.

        :param T_first_odom: turn to the frame of a first pose without an accelerometer, 4x4.
        """
        assert self._start is not None  # by :meth:`begin`
        position, before = self._start
        self._T_drifted_given = T_first_odom
        self._start, self._noise = None, None
        return Turn(T_first_odom, position, before, np.zeros((2, 2)), is_level=False)

    def doubted(self, doubt: float) -> Turn:
        """
        Let the first pose stay as level as it is, and be as uncertain as it is doubted.

        :param doubt: probability that it is wrong.
        :returns: for the poses that were held back since then.
        """
        assert self._start is not None  # by :meth:`begin`
        position, tilt = self._start
        return Turn(np.eye(4), position, tilt, _mixed(tilt, _UNKNOWN_TILT, doubt))

    def apply(self, pose: PoseWithCovariance, doubt: float = 0.0) -> PoseWithCovariance:
        """
        Return a pose in the level frame.

        Roll and pitch are as uncertain as gravity leaves them, by what the pose has drifted since
        it was seen, and by what is not corrected yet; the rest as far as it depends on them.

        :param doubt: probability that the start is wrong, and roll and pitch unknown: those that
            were published cannot be turned back.
        """
        pose = self._drifted(pose)
        level = self._by_gravity(pose)
        if doubt == 0.0:
            return level
        start = None if self._start is None else (self._start[0], _UNKNOWN_TILT)
        unknown = self._since_level(pose, start)
        return level.with_covariance(_mixed(level.covariance, unknown.covariance, doubt))

    def _by_gravity(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose that has drifted in the level frame, as certain as gravity makes it."""
        level = self._since_level(pose, self._start)
        covariance = level.covariance
        if self._noise is None:
            return level
        tilt = covariance[_TILT, _TILT]
        by_tilt = np.linalg.lstsq(tilt, covariance[_TILT], rcond=None)[0].T
        by_tilt[_TILT] = np.eye(2)
        left = by_tilt @ self._error
        left[:3] += pose.translation - level.translation
        left[_TILT] = self._left
        known = self._noise + definite.nonnegative(tilt - self._before)
        rest = definite.nonnegative(covariance - by_tilt @ tilt @ by_tilt.T)
        return level.with_covariance(
            rest + by_tilt @ known @ by_tilt.T + np.outer(left, left))

    def approach(self, up: Direction, pose: PoseWithCovariance, elapsed: float) -> None:
        """
        Turn the frame towards the level one.

        The error is corrected as far as it exceeds the uncertainty of gravity: what that changes
        by would be added to the motion.

        :param up: in the frame that has drifted.
        :param pose: ``T_drifted_camera``, with its covariance since the start.
        :param elapsed: time since the last step, less than a second [s].
        """
        pose = self._drifted(pose)
        if self._T_drifted_given is not None:
            up = up.in_axes(self._T_drifted_given[:3, :3])
        seen = up.in_axes(self._T_level_drifted[:3, :3])
        self._noise = _TILT_BY_UP @ seen.covariance @ _TILT_BY_UP.T
        error = se3.rotation_between(seen.vector, UP)
        angle = max(math.hypot(*error), 1e-12)
        uncertain = math.sqrt(error[:2] @ self._noise @ error[:2]) / angle
        significant = max(angle - uncertain, 0.0)
        turn = min(significant / _TIME, _FASTEST) * elapsed
        step = turn / angle * error
        levelled = se3.perturbed(self._T_level_drifted @ pose.matrix,
                                 np.concatenate([np.zeros(3), step]))
        self._T_level_drifted = levelled @ se3.inverse(pose.matrix)
        self._left = (error - step)[:2]
        self._error = se3.rotation_between(up.vector, UP)[:2]
        self._before = self._since_level(pose, self._start).covariance[_TILT, _TILT]

    def _drifted(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose that is given in the frame that began level, and has drifted since."""
        if self._T_drifted_given is None:
            return pose
        drifted: PoseWithCovariance = self._T_drifted_given @ pose
        return drifted

    def _since_level(self, pose: PoseWithCovariance,
                     start: tuple[np.ndarray, np.ndarray] | None) -> PoseWithCovariance:
        """
        Return a pose in the level frame, with the error of the first one that was level.

        :param start: its position, 3 [m], and the covariance of its roll and pitch, 2x2 [rad^2].
        """
        if start is not None:
            position, tilt = start
            by_tilt = at_point(pose.translation - position)[:, _TILT]
            pose = pose.with_covariance(pose.covariance + by_tilt @ tilt @ by_tilt.T)
        return self._T_level_drifted @ pose


def _mixed(known: np.ndarray, unknown: np.ndarray, doubt: float) -> np.ndarray:
    """Return the covariance of an error that is, with the probability of a doubt, the unknown."""
    mixed: np.ndarray = (1.0 - doubt) * known + doubt * unknown
    return mixed


def level_orientation(up: np.ndarray) -> np.ndarray:
    """
    Return the orientation ``R_level_camera`` of an optical frame, by what is up in it, 3x3.

    A camera that looks ahead looks along x; any other is turned from there by the least angle.
    """
    ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    orientation: np.ndarray = se3.exp_rotation(se3.rotation_between(ahead @ up, UP)) @ ahead
    return orientation
