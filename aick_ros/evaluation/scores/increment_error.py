# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Error of a measured motion, and its NEES."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.consistency import nees
from aick_ros.geometry import se3

MAX_TRANSLATION_ERROR = 0.05  # chosen
"""Above this translation error an increment is wrong [m]."""

MAX_ROTATION_ERROR = float(np.radians(3.0))  # chosen
"""Above this rotation error an increment is wrong [rad]."""


@dataclass(frozen=True)
class IncrementError:
    """
    The error of one increment, by the error model of :mod:`aick_ros.geometry.se3`.

    :param translation: translation error of Eq. 3 [m].
    :param rotation: rotation error of Eq. 3 [rad].
    :param nees: with the covariance of the increment; None where that is not finite.
    """

    translation: float
    rotation: float
    nees: float | None

    @classmethod
    def of(cls, increment: np.ndarray, covariance: np.ndarray,
           true_increment: np.ndarray) -> IncrementError:
        """
        Return the error of an increment.

        :param increment: ``T_target_source``, 4x4.
        :param covariance: 6x6, in the axes of the target.
        :param true_increment: 4x4.
        """
        error = se3.difference(increment, true_increment)
        return cls(float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])),
                   nees(error, covariance))

    @property
    def is_wrong(self) -> bool:
        """An error above 5 cm or 3 degrees."""
        return (self.translation > MAX_TRANSLATION_ERROR
                or self.rotation > MAX_ROTATION_ERROR)
