# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Check of an accelerometer whose value never changes: stuck, or without noise at rest."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import definite, se3
from aick_ros.geometry.pose import PoseWithCovariance, along_all_axes
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.sample_check import SampleCheck

_GRAVITIES = 9.8, 9.80665, 9.81  # m/s^2; by definition: those of simulators
_EXACT = 1e-3  # m/s^2; chosen: beyond what single precision and a solver of contacts leave

_CHANCE = 0.01
"""Probability that a value of such a length is that of a stuck sensor.

Derived: of sensors whose length of gravity errs by 0.2 m/s^2, 0.012 are stuck at one of these by
chance, if as many are stuck as have no noise."""

_MOVED = 45.0
"""Squared distance of two poses by their covariance from which on the camera has moved.

Chosen: noise exceeds it in one of ten million frames, and a rest may last for hours."""

_SETTLED = NANOSECONDS // 2  # by definition: as long as a value that never changes has not

_FLOOR = along_all_axes(0.005 ** 2, math.radians(0.3) ** 2)
"""Covariance that poses of a camera at rest have beside their own, 6x6 [m^2, rad^2].

Chosen: a motion by 4 cm or 2 deg is noticed, and a scatter by a few millimetres is none."""


class RestCheck:
    """
    Tells a value that never changes as the sensor is stuck from one without noise, at rest.

    Simulated sensors may have neither noise nor bias. At rest their value is the gravity of a
    simulator, a gyroscope beside it does not change either, and the camera does not tilt or move.
    One that is stuck looks so by chance, or since its driver makes the value up: of that a small
    doubt is left.
    """

    def __init__(self, samples: SampleCheck) -> None:
        self._samples = samples
        self._rates = SampleCheck('gyroscope', 'rad/s', math.inf)
        self._has_noise: bool | None = None  # of the gyroscope; None: there is none, or not yet
        self._rates_since: int | None = None  # stamp of its first value [ns]
        self._moved_since: int | None = None  # stamp of the value during which it has moved [ns]
        self.restart()

    def restart(self) -> None:
        """Continue with poses that are measured anew; what has moved so far remains."""
        self._first: tuple[int, PoseWithCovariance] | None = None  # with the stamp of its value
        self._latest: tuple[int, PoseWithCovariance] | None = None  # with its own stamp, to judge

    @property
    def doubt(self) -> float:
        """Probability that the sensor is stuck; 0 where its value changes."""
        if not self._samples.unchanged:
            return 0.0
        has_moved = self._moved_since == self._samples.unchanged_since
        return _CHANCE if self._is_exact and not self._has_noise and not has_moved else 1.0

    @property
    def _is_exact(self) -> bool:
        length = math.hypot(*self._samples.value)
        return min(abs(length - gravity) for gravity in _GRAVITIES) <= _EXACT

    def add(self, samples: ImuSamples) -> None:
        """Note whether a gyroscope beside it has noise: not if it was ever constant."""
        self._judge()
        if self._has_noise is False:
            return
        stamps, _ = self._rates.usable(samples.stamps, samples.turn_rates)
        if len(stamps):
            if self._rates_since is None:
                self._rates_since = int(stamps[0])
            if int(stamps[-1]) - self._rates_since > _SETTLED:
                self._has_noise = not self._rates.unchanged

    def note(self, stamp: int, pose: PoseWithCovariance) -> None:
        """
        Note a pose that was measured.

        :param stamp: of it, by the clock of the samples [ns].
        :param pose: ``T_reckoned_camera``, with the covariance of this measurement alone.
        """
        self._latest = stamp, pose
        self._judge()

    def _judge(self) -> None:
        """Compare the last pose with the first one, once the value at its stamp is known."""
        if self._latest is None or not (self._is_exact and self._samples.unchanged
                                        and self._samples.was_unchanged_at(self._latest[0])):
            return
        (_, pose), self._latest = self._latest, None
        since = self._samples.unchanged_since
        if self._first is None or self._first[0] != since:
            self._first = since, pose
        elif _differ(self._first[1], pose, self._samples.value):
            self._moved_since = since


def _differ(first: PoseWithCovariance, pose: PoseWithCovariance, force: np.ndarray) -> bool:
    """Return whether poses differ by more than noise, and by a turn about a force, 3."""
    motion, up = pose.relative_to(first), force / math.hypot(*force)
    tilt = se3.rotation_between(up, motion.rotation @ up)
    error = np.concatenate([motion.translation, tilt])
    return float(error @ definite.solve(motion.covariance + _FLOOR, error)) > _MOVED
