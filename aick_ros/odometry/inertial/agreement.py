# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Agreement of the rotations of a gyroscope with those of the camera."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import definite, se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES
from aick_ros.odometry.inertial.disagreement import Disagreement
from aick_ros.odometry.inertial.rotation_integral import Turn

_FLOOR = np.radians(0.15)
"""Error of a rotation of the camera that its covariance may miss [rad], chosen."""

_MEMORY = 8.0  # frames; chosen: the share has settled after a quarter of a second at 30 Hz
_FIRST = 8  # rotations that have to agree before any is used; chosen likewise
_RETRIED = 30  # rotations; chosen: after so many what was learned may be what is wrong
_WRONG, _RIGHT = 0.5, 0.1  # chosen: shares of them from which on it is used no more, or again


class Agreement:
    """
    Compares rotations; while most of the recent ones disagree, the gyroscope is not used.

    Nor is it before some have agreed: one that is mounted otherwise, or counts in degrees, would
    turn the first poses.
    """

    def __init__(self) -> None:
        self._agreed = 0  # number of rotations so far
        self._disagreement = Disagreement(_MEMORY, _WRONG, _RIGHT)
        self._turned = np.zeros(2)  # by the gyroscope and by the camera, of those [rad]

    @property
    def is_confirmed(self) -> bool:
        """Agreement of the camera with enough rotations of the gyroscope, and with the last."""
        return self._agreed >= _FIRST and not self._disagreement.is_wrong

    @property
    def is_to_be_learned_anew(self) -> bool:
        """Disagreement for another second, of which what was learned may be the cause."""
        return self._disagreement.is_wrong and self._disagreement.wrong_for % _RETRIED == 0

    @property
    def complaint(self) -> str:
        """The disagreement in one sentence; '' where they agree."""
        if not self._disagreement.is_wrong:
            return ''
        gyroscope, camera = np.degrees(self._turned)
        return (f'the gyroscope turns by {gyroscope:.1f} deg where the camera sees {camera:.1f} '
                'deg, or about another axis: check the pose of the IMU in the camera, and that '
                'its samples are in rad/s')

    def note(self, error: np.ndarray, covariance: np.ndarray, turn: Turn) -> bool:
        """
        Note the error of one rotation, and return whether it is one of noise.

        :param error: 3, from the gyroscope's rotation to the camera's [rad].
        :param covariance: 3x3, of the error.
        """
        expected = covariance + _FLOOR ** 2 * np.eye(3)
        square = float(error @ definite.solve(expected, error))
        agrees = square <= LARGEST_SQUARED_DISTANCES[3]
        self._disagreement.note(agrees)
        if agrees:
            self._agreed += 1
        else:
            seen = se3.exp_rotation(error) @ turn.rotation
            self._turned = np.array([se3.angle(turn.rotation), se3.angle(seen)])
        return agrees
