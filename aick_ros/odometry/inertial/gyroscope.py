# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rotation of the camera by a gyroscope, as long as the camera confirms it."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.inertial.agreement import Agreement
from aick_ros.odometry.inertial.gyroscope_calibration import GyroscopeCalibration
from aick_ros.odometry.inertial.recent_reference import RecentReference
from aick_ros.odometry.inertial.rotation_integral import RotationIntegral, Turn
from aick_ros.odometry.inertial.sample_check import SampleCheck
from aick_ros.odometry.motion_term import ROTATION, MotionTerm
from aick_ros.settings import ImuSettings, OdometrySettings

_LARGEST_RATE = 100.0  # rad/s; chosen: beyond the range of every gyroscope for cameras

_PERSISTENCE = 0.5
"""Time for which the error of the estimated bias stays the same [s].

Chosen on rendered shakes and on rendered recordings by hand, of 5 and of 20 seconds."""

_OWN_AXES = math.radians(1.5)
"""Rotation of the gyroscope's axes against those of the accelerometer [rad].

Chosen: a rotation that is found and far larger is that of the whole IMU. With it the positions of
IMUs that nobody has calibrated err no more than with accelerations as the transform gives them,
and those of IMUs that are mounted 5 deg off a third as much."""

_KNOWN_MOUNTING = math.radians(0.5) ** 2  # rad^2; chosen: a camera by hand shows it in seconds


class Gyroscope:
    """
    Integrates the samples of a gyroscope, and learns its errors from the motion of the camera.

    :param settings: noise of the gyroscope.
    :param odometry: the acceleration noise, by which samples that have not arrived are missed.
    """

    def __init__(self, settings: ImuSettings, odometry: OdometrySettings) -> None:
        self._calibration = GyroscopeCalibration(settings)
        self.configure(settings, odometry)
        self._integral = RotationIntegral()
        self._samples = SampleCheck('gyroscope', 'rad/s', _LARGEST_RATE)
        self._agreement = Agreement()
        self._mounting, self._mounting_variance = np.eye(3), math.inf  # [rad^2]
        self.restart()

    def restart(self) -> None:
        """Continue with frames that are measured anew; what was learned is kept."""
        self._reference = RecentReference()
        self._calibration.restart()

    def configure(self, settings: ImuSettings, odometry: OdometrySettings) -> None:
        """Continue with other settings; what was learned is kept."""
        self._settings = settings
        self._calibration.configure(settings)
        self._acceleration_sigma = odometry.angular_acceleration_sigma

    @property
    def bias(self) -> np.ndarray:
        """Estimated bias, 3 [rad/s]."""
        return self._calibration.bias.copy()

    @property
    def bias_sigma(self) -> np.ndarray:
        """Standard deviation of the estimated bias, 3 [rad/s]."""
        sigma: np.ndarray = np.sqrt(np.diag(self._calibration.covariance)[:3])
        return sigma

    @property
    def time_offset(self) -> float:
        """Estimated time offset [s]."""
        return self._calibration.offset

    @property
    def mounting(self) -> np.ndarray:
        """Rotation of the axes of all samples to those of the camera as it was found, 3x3."""
        return self._mounting

    @property
    def dropped(self) -> int:
        """Number of samples that could not be used."""
        return self._samples.dropped

    @property
    def complaint(self) -> str:
        """The contradiction of the samples to the camera, in words; '' where there is none."""
        disagreement = self._agreement.complaint
        return disagreement and '; '.join(filter(None, (self._samples.unchanged, disagreement)))

    @property
    def description(self) -> str:
        """Bias, time offset and what was dropped, in words; 'none' without samples."""
        if self._integral.last is None:
            return 'none'
        x, y, z = np.degrees(self.bias)
        sigma, dropped = np.degrees(self.bias_sigma.max()), self._samples.dropped
        turned, scaled = self._calibration.axes_correction
        return (f'bias ({x:.2f}, {y:.2f}, {z:.2f}) deg/s, known to {sigma:.2f}; its clock is '
                f'{1e3 * self.time_offset:.1f} ms ahead of that of the images; to fit the camera '
                f'its axes are turned by {np.degrees(turned):.1f} deg and scaled by up to '
                f'{100 * scaled:.1f} %'
                + (f'; {dropped} samples dropped' if dropped else ''))

    @property
    def _is_plausible(self) -> bool:
        return (self._integral.last is not None
                and not self._samples.unchanged and not self._agreement.complaint)

    @property
    def _is_used(self) -> bool:
        return self._is_plausible and self._agreement.is_confirmed

    def add(self, samples: ImuSamples) -> None:
        """Add samples; those that cannot be used are counted and dropped."""
        before = self._integral.last
        self._integral.add(*self._samples.usable(samples.stamps, samples.turn_rates))
        if before is not None and (last := self._integral.last) is not None and last > before:
            self._calibration.elapse(seconds(before, last))

    def term(self, start: int, end: int, is_summed: bool = False) -> MotionTerm | None:
        """
        Return the rotation between two stamps of images [ns]; None: it is not known.

        :param is_summed: whether such motions are added up, as independent ones. The errors of
            the calibration are the same in all of them: their covariance is then that of the
            sum, as if the camera turned on alike.
        """
        turn = self._turn(start, end) if self._is_used else None
        if turn is None:
            return None
        rotation = np.eye(4)
        rotation[:3, :3] = turn.rotation
        factor = max(_PERSISTENCE / turn.duration, 1.0) if is_summed else 1.0
        return MotionTerm(rotation, ROTATION,
                          self._noise(turn) + factor * self._calibration.uncertainty(turn))

    def rate_at(self, stamp: int) -> np.ndarray | None:
        """Return the turn rate at the stamp of an image [ns], 3 [rad/s]; None: not known."""
        turn = self._turn(stamp, stamp) if self._is_used else None
        return None if turn is None else turn.rates[1]

    def rotation(self, start: int, end: int) -> np.ndarray | None:
        """
        Return the rotation between two stamps of images [ns], 3x3; None: it is not known.

        It may be from before the first image, so that no camera has confirmed it.
        """
        turn = self._turn(start, end) if self._is_plausible else None
        return None if turn is None else turn.rotation

    def learn(self, start: int, end: int, seen: PoseWithCovariance) -> None:
        """
        Compare with a motion that the camera alone has measured, and learn from it.

        :param start: stamp of the keyframe [ns]; end: of the frame.
        :param seen: ``T_keyframe_camera``.
        """
        if end <= start or self._integral.last is None:
            return
        start, seen = self._reference.motion(start, end, seen)
        if end <= start:
            return
        turn = self._turn(start, end)
        if turn is None:
            return
        error = se3.log_rotation(seen.rotation @ turn.rotation.T)
        covariance = seen.covariance[3:, 3:]
        total = covariance + self._noise(turn) + self._calibration.uncertainty(turn)
        if self._agreement.note(error, total, turn):
            self._calibration.learn(start, turn, error, covariance + self._missed(turn))
            self._find_mounting()
        elif self._agreement.is_to_be_learned_anew:
            self._calibration = GyroscopeCalibration(self._settings)

    def _find_mounting(self) -> None:
        """
        Take a rotation of the axes for that of the whole IMU, as far as it is one.

        What was known better before the gyroscope was learned anew stays.
        """
        variance = self._calibration.turned_variance
        if not self._is_used or variance > max(self._mounting_variance, _KNOWN_MOUNTING):
            return
        turn = se3.log_rotation(self._calibration.turned)
        square = float(turn @ turn)
        share = square / (square + _OWN_AXES ** 2 + variance)
        self._mounting, self._mounting_variance = se3.exp_rotation(share * turn), variance

    def _turn(self, start: int, end: int) -> Turn | None:
        offset = round(self._calibration.offset * NANOSECONDS)
        return self._integral.between(start + offset, end + offset, self._calibration.bias,
                                      self._calibration.matrix)

    def _noise(self, turn: Turn) -> np.ndarray:
        """Return the covariance of a rotation by the noise of the rates, 3x3 [rad^2]."""
        variance = self._settings.gyroscope_noise ** 2 * turn.duration
        covariance: np.ndarray = variance * np.eye(3) + self._missed(turn)
        return covariance

    def _missed(self, turn: Turn) -> np.ndarray:
        """
        Return the covariance of a rotation by what is between samples, 3x3 [rad^2].

        Or after the last one that has arrived.
        """
        sigma = 0.5 * self._acceleration_sigma * turn.extrapolated ** 2
        covariance: np.ndarray = (
            sigma ** 2 + self._integral.interpolation_variance) * np.eye(3)
        return covariance
