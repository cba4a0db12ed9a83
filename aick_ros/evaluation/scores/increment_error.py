# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How far a measured motion is off, and how far its covariance let one expect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.consistency import nees
from aick_ros.geometry import se3

MOST_TRANSLATION = 0.05
"""An increment farther off is wrong [m]."""

MOST_ROTATION = float(np.radians(3.0))
"""An increment turned farther from the truth is wrong [rad]."""


@dataclass(frozen=True)
class IncrementError:
    """
    The error of one increment, by the error model of :mod:`aick_ros.geometry.se3`.

    :param translation: [m]; rotation: [rad]; as by Eq. 3.
    :param nees: of the error with the increment's covariance; None where that is not finite.
    """

    translation: float
    rotation: float
    nees: float | None

    @classmethod
    def of(cls, increment: np.ndarray, covariance: np.ndarray,
           true_increment: np.ndarray) -> IncrementError:
        """
        Return the error of an increment.

        :param increment: ``T_target_source``, 4x4; covariance: 6x6 about the target's fixed axes.
        """
        error = se3.difference(increment, true_increment)
        return cls(float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])),
                   nees(error, covariance))

    @property
    def is_wrong(self) -> bool:
        """Whether it is off by more than 5 cm or 3 degrees."""
        return self.translation > MOST_TRANSLATION or self.rotation > MOST_ROTATION
