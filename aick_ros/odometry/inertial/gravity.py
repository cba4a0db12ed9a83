# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Gravity, by an accelerometer, as long as the camera confirms it, and the level frame by that."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import definite, se3
from aick_ros.geometry.pose import PoseWithCovariance, in_axes
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.inertial.disagreement import Disagreement
from aick_ros.odometry.inertial.displacement import Displacement, LastMeasured, Limits
from aick_ros.odometry.inertial.first_force import (
    RotationBetween, first_force, may_be_gravity, tilt_variance, variance)
from aick_ros.odometry.inertial.followed import STEP, Followed
from aick_ros.odometry.inertial.force_integral import AS_GIVEN, ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GravityFilter
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.inertial.level import UP, Level, Turn, level_orientation
from aick_ros.odometry.inertial.rest_check import RestCheck
from aick_ros.odometry.inertial.sample_check import SampleCheck
from aick_ros.odometry.inertial.start_check import StartCheck
from aick_ros.settings import ImuSettings

_TILT = slice(3, 5)  # by definition: rotations about x and y of a level frame
_LARGEST_FORCE = 400.0  # m/s^2; chosen: beyond the range of every accelerometer for cameras
_LONGEST_STEP = 0.2  # s; chosen: a camera turns evenly meanwhile
_UNKNOWN = 0.5  # m/s; chosen: half of the standard deviation of a velocity that is not known
_MEMORY = 30.0  # frames; chosen: a second at 30 Hz
_WRONG, _RIGHT = 0.2, 0.05
"""Shares of them that disagree from which on it is used no more, or again.

Chosen: turned by 30 deg a third disagrees, and on two excerpts of real recordings 0.04."""

_OFFSET_SIGMA = 0.03
"""Standard deviation of the time offset of an accelerometer without a gyroscope [s].

Measured on a Kinect, whose images are stamped on arrival: -0.02 and -0.03 s. On rendered rooms
without an offset gravity is known as early with it as with a sixth of it."""

_RETRIED = 90  # frames; chosen: a filter that is right settles meanwhile
_MISSED = 30  # frames; chosen: a jolt is over
_SHOWN = math.radians(1.5)
"""Standard deviation of the direction of gravity from which on the motion shows it [rad], chosen.

At rest the camera contradicts no direction."""


class Gravity:
    """
    Begins the odometry level, and keeps it so.

    Beside a gyroscope it estimates gravity where the odometry is not level, too, as displacements
    need it.

    :param settings: noise of the accelerometer.
    :param turn: rotation by a gyroscope.
    """

    def __init__(self, settings: ImuSettings,
                 turn: RotationBetween = lambda start, end: None) -> None:
        self._settings = settings
        self._turn = turn
        self._samples = SampleCheck('accelerometer', 'm/s^2', _LARGEST_FORCE)
        self._rest_check = RestCheck(self._samples)
        self._forces = ForceIntegral()
        self._T_camera_imu = np.eye(4)  # in the axes of the camera
        self._has_gyroscope = False
        self._filter: GravityFilter | None = None
        self._offset = 0
        self.reset()

    def configure(self, settings: ImuSettings) -> None:
        """
        Continue with other settings; what was learned is kept.

        With others that count at the start alone it begins anew.
        """
        if _at_start(settings) != _at_start(self._settings):
            self._filter = None
        elif self._filter is not None:
            self._filter.configure(settings)
        self._settings = settings

    def reset(self) -> None:
        """Forget which frame was level; samples are kept."""
        self.start: np.ndarray | None = None
        """Level pose of the first frame, 4x4; None where the odometry is not level."""
        self._disagreement = Disagreement(_MEMORY, _WRONG, _RIGHT)
        self._start_check = StartCheck()
        self._no_gravity = 0.0  # length of a first force that is none [m/s^2]
        self._missed_for = 0  # frames since then
        self._is_held = False
        self.restart()

    def restart(self) -> None:
        """Continue in a frame that is level, with poses that are measured anew and not held."""
        self._filter = None
        self._level = Level()
        self._start_check.restart()
        self._rest_check.restart()
        self._levelled_at: int | None = None  # stamp of the force by which the start is level [ns]
        self._is_held &= self.start is None  # before a level start there is nothing to end yet
        self._stamp: int | None = None  # of the last pose
        self._last = self._reference = PoseWithCovariance.identity()

    def hold(self) -> None:
        """Leave the start as level as it is, until :meth:`begin_anew` or a restart after it."""
        self._is_held = True

    @property
    def is_held(self) -> bool:
        """Existence of a level start that is left as it is."""
        return self._is_held and self.start is not None

    @property
    def tilt_sigma(self) -> float:
        """Standard deviation of the direction of gravity [rad]; infinite: it is not known."""
        if self._is_doubted or self._start_check.doubt:
            return math.inf
        return self._sigma

    @property
    def _sigma(self) -> float:
        """The same, of an accelerometer that is right."""
        known = self._filter  # another thread may forget it meanwhile
        return math.inf if known is None else definite.largest_sigma(known.up.covariance)

    @property
    def _is_doubted(self) -> bool:
        return bool(self._samples.unchanged) or self._disagreement.is_suspected

    @property
    def _is_stuck(self) -> bool:
        """A value that never changes, and is not that of a sensor without noise at rest."""
        return self._rest_check.doubt == 1.0

    @property
    def _is_for_displacements(self) -> bool:
        """Use of what is up for displacements, which need a gyroscope."""
        return self._has_gyroscope and self._settings.dead_reckoning_sigma > 0.0

    @property
    def estimate(self) -> GravityFilter | None:
        """Copy of gravity, bias, lever arm and time offset; None: they are not estimated yet."""
        known = self._filter  # another thread may forget it meanwhile
        return None if known is None else known.copy()

    @property
    def stamp(self) -> int | None:
        """Stamp of the last frame whose pose was measured [ns]; None: there is none."""
        return self._stamp

    @property
    def up(self) -> np.ndarray | None:
        """Direction of gravity, 3, upwards, in the camera's axes there; None: it is not known."""
        known = self._filter
        return None if known is None else self._last.rotation.T @ known.up.vector

    def displacement(self, gyroscope: Gyroscope, limits: Limits,
                     factor: float) -> Displacement | None:
        """
        Return what follows the camera from the last frame on; None: nothing is known there.

        Parameters are as for :class:`Displacement`.
        """
        if (self._stamp is None or self._filter is None or self._is_doubted
                or self._filter.velocity_sigma > _UNKNOWN):
            return None
        known = self._filter.copy()  # which goes on with the next frame
        return Displacement(LastMeasured(
            self._stamp, known, self._last, self._offset + round(known.time_offset * NANOSECONDS),
            self._T_camera_imu[:3, 3].copy()), self._forces, gyroscope, limits, factor)

    @property
    def complaint(self) -> str:
        """The contradiction of the samples to gravity or camera; '' where there is none."""
        if self._is_stuck:
            return self._samples.unchanged
        if self._missed_for >= _MISSED:
            return (f'the accelerometer measures {self._no_gravity:.2f} m/s^2, and gravity is '
                    '9.8: check that its samples are in m/s^2, not in g')
        if self._disagreement.is_wrong:
            return ('the accelerometer contradicts the motion of the camera: check the pose of '
                    'the IMU in the camera')
        return ''

    @property
    def description(self) -> str:
        """Bias and how well the direction is known, in words."""
        if self._forces.last is None:
            return 'none'
        if self.start is None and not self._is_for_displacements:
            return 'not used, as odom did not begin level'
        start = '' if self.start is not None else 'odom did not begin level; '
        known = self._filter  # another thread may forget it meanwhile
        if known is None:
            return f'{start}not compared with the camera yet'
        x, y, z = known.bias
        sigma = np.degrees(definite.largest_sigma(known.up.covariance))
        return (f'{start}bias ({x:.2f}, {y:.2f}, {z:.2f}) m/s^2; {_place_of(known)}the direction '
                f'of gravity is known to {sigma:.2f} deg')

    def add(self, samples: ImuSamples, time_offset: float,
            mounting: np.ndarray = AS_GIVEN) -> None:
        """
        Add samples; those that cannot be used are dropped.

        :param time_offset: added to the stamps of the images to get those of the samples [s].
        :param mounting: rotation of the axes of the samples to those of the camera, 3x3.
        """
        turn, known = self._forces.mount(mounting), self._filter
        if turn is not None and known is not None:
            known.turn(turn)
        self._offset = round(time_offset * NANOSECONDS)
        self._T_camera_imu[:3, 3] = samples.position
        self._has_gyroscope |= bool(np.isfinite(samples.turn_rates).any())
        self._forces.add(*self._samples.usable(samples.stamps, samples.accelerations))
        self._rest_check.add(samples)
        self._check_start()

    def begin(self, stamp: int) -> PoseWithCovariance | None:
        """Return the level pose of a first frame; None: what is up is not known."""
        force = self._first_force(stamp) if self._settings.gravity else None
        if force is None:
            return None
        self.start = np.eye(4)
        self.start[:3, :3] = level_orientation(force / np.linalg.norm(force))
        self._begin_level(stamp, self.start[:3, 3], force)
        return PoseWithCovariance(self.start.copy())

    def begin_again(self, stamp: int, pose: PoseWithCovariance) -> PoseWithCovariance | None:
        """
        Return the pose of a first frame, turned by the least angle to where the force is up.

        The odometry goes on in its level frame, with a camera that may have been turned meanwhile:
        roll and pitch are known by the force alone, whose bias is not known yet.

        :param pose: the last one, whose position and heading are kept.
        :returns: with a covariance that is without the error of its tilt, which :meth:`levelled`
            adds; None: the odometry is not level, or what is up is not known or contradicted.
        """
        is_used = (self._settings.gravity and self.start is not None and not self.complaint
                   and self._start_check.doubt < 1.0)
        force = self._first_force(stamp) if is_used else None
        if force is None:
            return None
        turn = se3.rotation_between(pose.rotation @ force / np.linalg.norm(force), UP)
        covariance = pose.covariance.copy()
        covariance[_TILT], covariance[:, _TILT] = 0.0, 0.0
        self._begin_level(stamp, pose.translation, force)
        return PoseWithCovariance(se3.perturbed(pose.matrix, np.append(np.zeros(3), turn)),
                                  covariance)

    def begin_anew(self, T_odom_reckoned: np.ndarray, corrected: PoseWithCovariance,
                   sigma: float) -> Turn | None:
        """
        Let the odometry have begun level by what is known now.

        All poses since the start turn about the first one, so nothing may have been published.

        :param sigma: largest standard deviation of the direction of gravity [rad].
        :returns: the turn of the poses since :meth:`hold`, to where they are without an
            accelerometer if the camera contradicts it. One that is suspected turns nothing, but
            they are less certain. None: they stay, as the odometry is not level, or the direction
            is known less well. Others are as for :meth:`update`.
        """
        if not self._is_held or self.start is None:
            return None
        self._is_held = False
        if self._disagreement.is_wrong or self._start_check.doubt == 1.0:
            turn, self.start = self._level.give_up(se3.inverse(self.start)), None
            return turn
        if self._start_check.doubt:
            return self._level.doubted(self._start_check.doubt)
        if self._filter is None or self.tilt_sigma > sigma:
            return None
        up = self._filter.up.in_axes(T_odom_reckoned[:3, :3])
        start = np.eye(4)
        start[:3, :3] = level_orientation(self.start[:3, :3].T @ up.vector)
        turn = self._level.begin_anew(start @ se3.inverse(self.start), up, corrected)
        self.start = start
        return turn

    def levelled(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose of the odometry in the level frame; one that is held has no doubt yet."""
        is_checked = self.start is not None and not self._is_held
        return self._level.apply(pose, self._start_check.doubt if is_checked else 0.0)

    def update(self, stamp: int, reference: PoseWithCovariance, measured: PoseWithCovariance,
               T_odom_reckoned: np.ndarray, corrected: PoseWithCovariance) -> None:
        """
        Add a pose that was measured.

        :param stamp: of the frame [ns].
        :param reference: ``T_reckoned_reference``, by dead reckoning.
        :param measured: ``T_reckoned_camera``, with the covariance of this measurement alone.
        :param T_odom_reckoned: correction of the dead reckoning, 4x4.
        :param corrected: the pose with it, ``T_odom_camera``, its covariance since the start.
        """
        is_level = self.start is not None and self._settings.gravity
        self._retry(stamp)
        self._rest_check.note(stamp + self._offset, measured)
        if not is_level and not self._is_for_displacements:
            return
        elapsed = _LONGEST_STEP if self._stamp is None else seconds(self._stamp, stamp)
        at_imu = measured @ self._T_camera_imu  # it is there that forces are measured
        self._advance(stamp, reference, at_imu)
        self._stamp, self._last, self._reference = stamp, at_imu, reference
        if is_level and not self._is_held and self._filter is not None and not self._is_doubted:
            up = self._filter.up.in_axes(T_odom_reckoned[:3, :3])
            self._level.approach(up, corrected, min(elapsed, _LONGEST_STEP))

    def _advance(self, stamp: int, reference: PoseWithCovariance,
                 measured: PoseWithCovariance) -> None:
        """Estimate gravity at a frame, by the pose of the IMU that was measured."""
        if self._filter is None or self._stamp is None:
            self._begin_filter(stamp, measured)
            return
        if reference is not self._reference:
            self._filter.drift(_added(reference, self._reference))
        offset = self._offset + round(self._filter.time_offset * NANOSECONDS)
        impulse = self._forces.between(self._stamp + offset, stamp + offset,
                                       self._last.rotation, measured.rotation)
        if impulse is not None and impulse.duration <= _LONGEST_STEP:
            self._filter.predict(impulse, measured.covariance[3:, 3:])
        else:
            followed = self._followed(self._filter, stamp, measured, offset)
            if followed is None:
                self._filter.place(measured)
                return
            self._filter = followed
        agrees = self._filter.measure(measured)
        if not agrees:
            self._filter.place(measured)
        self._note(agrees)

    def _followed(self, known: GravityFilter, stamp: int, measured: PoseWithCovariance,
                  offset: int) -> GravityFilter | None:
        """
        Return the filter at a frame after a longer time, as a loss, turned by the gyroscope.

        :param measured: its pose; other parameters are as for :meth:`_advance`.
        :param offset: time to add to the stamps of images to get those of the forces [ns].
        :returns: None: samples are missing.
        """
        assert self._stamp is not None  # the filter has begun
        followed: Followed | None = Followed(self._stamp, known, self._last.rotation)
        while followed is not None and followed.stamp < stamp:
            end = min(followed.stamp + STEP, stamp)
            turn = self._turn(self._stamp, end)
            if turn is None:
                return None
            rotation = measured.rotation if end == stamp else self._last.rotation @ turn
            followed = followed.moved(end, rotation, self._forces, offset,
                                      measured.covariance[3:, 3:])
        return None if followed is None else followed.estimate

    def _begin_filter(self, stamp: int, measured: PoseWithCovariance) -> None:
        force = self._first_force(stamp)
        if force is not None:
            is_placed, settings = self._T_camera_imu[:3, 3].any(), self._settings
            is_timed = self._has_gyroscope or settings.time_offset_sigma == 0.0
            self._filter = GravityFilter(
                settings, force, variance(force) * np.eye(3), measured,
                0.0 if is_placed else settings.position_sigma, 0.0 if is_timed else _OFFSET_SIGMA)

    def _first_force(self, stamp: int) -> np.ndarray | None:
        """Return the mean force before a frame, 3, in its axes; None: it is not known."""
        force = None if self._is_stuck else first_force(
            self._forces, self._turn, stamp, self._offset)
        if force is None:
            return None
        if may_be_gravity(force):
            return force
        self._no_gravity = self._no_gravity or math.hypot(*force)
        return None

    def _retry(self, stamp: int) -> None:
        """Count the frames without a force that may be gravity since the first; see if one is."""
        if not self._no_gravity:
            return
        self._missed_for += 1
        recent = self._forces.recent(stamp + self._offset, STEP)
        if len(recent) and may_be_gravity(recent.mean(axis=0)):  # a hand has shaken it before
            self._no_gravity, self._missed_for = 0.0, 0

    def _begin_level(self, stamp: int, position: np.ndarray, force: np.ndarray) -> None:
        """Begin with a first pose at a position, 3 [m], level by a force that has the bias, 3."""
        self._level.begin(position, tilt_variance(force, self._settings.accelerometer_bias_sigma))
        self._levelled_at = stamp + self._offset
        self._check_start()

    def _check_start(self) -> None:
        """Doubt a level start whose force may be that of a sensor which has been stuck since."""
        if self._levelled_at is not None and self._samples.is_unchanged_since(self._levelled_at):
            self._start_check.note(self._rest_check.doubt, is_shown=False)

    def _note(self, agrees: bool) -> None:
        """Note whether a position is the one expected; begin anew, and again, where it is not."""
        self._disagreement.note(agrees)
        self._start_check.note(self._disagreement.suspicion,
                               self._sigma < _SHOWN and not self._samples.unchanged)
        if self._disagreement.wrong_for % _RETRIED == 1:
            self._filter = None


def _at_start(settings: ImuSettings) -> tuple[float, ...]:
    """Return the settings that a filter begins with."""
    return (settings.accelerometer_bias_sigma, settings.position_sigma,
            settings.time_offset_sigma)


def _place_of(known: GravityFilter) -> str:
    """Return where an accelerometer was found to be, in words; '' where that was known."""
    if known.lever_arm_sigma == 0.0:
        return ''
    x, y, z = known.lever_arm
    return (f'position ({x:.2f}, {y:.2f}, {z:.2f}) m in the camera, to '
            f'{known.lever_arm_sigma:.2f}; ')


def _added(pose: PoseWithCovariance, before: PoseWithCovariance) -> np.ndarray:
    """Return the covariance that dead reckoning has added since a pose, 6x6."""
    axes = in_axes(before.rotation)
    added: np.ndarray = axes @ pose.since(before).covariance @ axes.T
    return added
