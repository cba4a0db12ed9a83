# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Result of a refinement."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.result import Fit, Registration, SensorBias
from aick_ros.registration.samples import Measure
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks

CONTRADICTION = 'the depths of the two frames contradict each other at most keypoints tracked'
"""Why a pose is rejected although keypoints confirm it."""


@dataclass(frozen=True, eq=False)
class Refined:
    """
    A refined pose.

    :param T_target_source: 4x4 [m].
    :param covariance: 6x6, of noise and of the bias expected [m^2, m rad, rad^2].
    :param systematic: 6x6, the part of the covariance that is the bias expected.
    :param tracked: keypoints of the source that the target sees where the pose puts them.
    :param is_contradicted: whether the depths of the two frames differ at most keypoints, by more
        than those of a right pose do.
    :param bias: between keypoints and depth; None where only keypoints are used.
    :param measure: measures what the residuals show of the camera; None where too few keypoints
        are tracked, or depth does not show the pose.
    :param fit: of the images to the pose.
    :param by_readout: 6, by how much the pose errs by the readout of colour that is not corrected
        [m/s, rad/s].
    """

    T_target_source: np.ndarray
    covariance: np.ndarray
    systematic: np.ndarray
    tracked: Tracks
    is_contradicted: bool = False
    bias: SensorBias | None = None
    measure: Measure | None = None
    fit: Fit | None = None
    by_readout: np.ndarray = field(default_factory=lambda: np.zeros(6))

    @property
    def pose(self) -> PoseWithCovariance:
        """The pose with its covariance."""
        return PoseWithCovariance(self.T_target_source, self.covariance)

    @property
    def is_confirmed(self) -> bool:
        """Support of the pose by enough keypoints, and by their depths."""
        return len(self.tracked) >= FEWEST_TO_CONFIRM and not self.is_contradicted

    def applied_to(self, registration: Registration, reason: str) -> Registration:
        """Return a registration with this pose and what supports it."""
        return replace(
            registration, T_target_source=self.T_target_source, covariance=self.covariance,
            systematic=self.systematic, bias=self.bias, support=len(self.tracked),
            tracks=self.tracked, measure=self.measure, fit=self.fit,
            by_readout=self.by_readout, reason=reason)
