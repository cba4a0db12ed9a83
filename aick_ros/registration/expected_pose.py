# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motion between two frames as it is expected before their images are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.borders.values import number, numbers
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import MAX_STAMP, seconds
from aick_ros.registration.prediction import Prediction


@dataclass(frozen=True, eq=False)
class ExpectedPose:
    """
    Pose of a frame in another one as it is expected before the images are compared.

    :param T_target_source: 4x4, at constant velocity or by other sensors.
    :param elapsed: time since that velocity was measured [s].
    :param steady: at constant velocity, 4x4, where other sensors have a part in the pose expected;
        None: they have not. The images are as uncertain as their motion has changed since,
        whatever others say.
    :param timing: standard deviations of the position and of the orientation, by the errors of
        stamps of a camera at this velocity [m, rad].
    """

    T_target_source: np.ndarray
    elapsed: float = np.inf
    steady: np.ndarray | None = None
    timing: tuple[float, float] = (0.0, 0.0)

    def checked(self) -> ExpectedPose:
        """
        Return the pose with its numbers as float64; times that no stamps have are infinite.

        :raises InputError: where a pose is not rigid, the time is less than 1 ns, or an error of
            stamps is negative.
        """
        elapsed = number(self.elapsed, 'elapsed')
        if elapsed < seconds(0, 1):
            raise InputError(f'elapsed is {elapsed:g} s: it must be 1 ns at least')
        position, orientation = numbers(self.timing, (2,), 'the errors of stamps').tolist()
        if min(position, orientation) < 0.0:
            raise InputError(f'the errors of stamps are {position:g} m and {orientation:g} rad: '
                             'they must not be negative')
        return ExpectedPose(
            se3.checked(self.T_target_source, 'the pose expected'),
            elapsed if elapsed <= 2 * seconds(0, MAX_STAMP) else np.inf,
            None if self.steady is None else se3.checked(
                self.steady, 'the pose at constant velocity'),
            (position, orientation))

    @property
    def at_constant_velocity(self) -> np.ndarray:
        """``T_target_source`` at constant velocity, 4x4."""
        return self.T_target_source if self.steady is None else self.steady

    def seen_from(self, T_reference_target: np.ndarray) -> ExpectedPose:
        """
        Return the pose expected in another frame, by that of the target in it, 4x4.

        Its rotation is made one again: poses that are refined from what poses before them let
        expect would double their errors of rounding from frame to frame.
        """
        def moved(pose: np.ndarray) -> np.ndarray:
            return se3.perturbed(T_reference_target @ pose, np.zeros(6))

        return ExpectedPose(moved(self.T_target_source), self.elapsed,
                            None if self.steady is None else moved(self.steady), self.timing)

    def change_to(self, T_target_source: np.ndarray) -> np.ndarray:
        """Return the pose of the camera, 4x4 in the target, in the camera as it is expected."""
        change: np.ndarray = se3.inverse(self.T_target_source) @ T_target_source
        return change

    def prediction(self, twist: np.ndarray | None) -> Prediction | None:
        """Return the pose with a body velocity [m/s, rad/s]; None where that is not known."""
        return Prediction.of(self.T_target_source, twist, self.elapsed)
