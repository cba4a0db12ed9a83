# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pose of a frame at the velocity measured last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3

CHANGE = 1.25
"""Change of the velocity up to a frame, by that of its mean over the interval before the frame.

Chosen on two excerpts of real recordings and on rendered cameras: 1.5 would be the velocity at
constant acceleration, but has more noise, and the mean itself lags."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """
    Pose that a frame would have at the velocity measured last.

    :param T_target_source: 4x4.
    :param twist: that velocity, of the body [m/s, rad/s].
    :param elapsed: time since it was measured [s].
    """

    T_target_source: np.ndarray
    twist: np.ndarray
    elapsed: float

    @classmethod
    def of(cls, T_target_source: np.ndarray | None, twist: np.ndarray | None,
           elapsed: float) -> Prediction | None:
        """Return the prediction; None where the velocity is not known."""
        if T_target_source is None or twist is None or not 0.0 < elapsed < np.inf:
            return None
        return cls(T_target_source, twist, elapsed)

    def twist_with(self, T_target_source: np.ndarray) -> np.ndarray:
        """Return the body velocity at a measured pose, 6."""
        deviation = se3.inverse(self.T_target_source) @ T_target_source
        measured = se3.log(se3.exp(self.twist * self.elapsed) @ deviation) / self.elapsed
        twist: np.ndarray = self.twist + CHANGE * (measured - self.twist)
        return twist
