# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether keypoints and depth tell of the same motion.

Keypoints on an object that passes show its motion, with little left of the residuals of the scene
behind it where a turn of the camera makes up for it. The surfaces of the scene have not turned.
"""

from __future__ import annotations

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.result import Registration, SensorBias
from aick_ros.registration.tracks import Tracks

_UNUSUAL = 3.75
"""Ratio of the least normalised square of a bias to what is usual, from which on it is unusual.

Chosen: while nothing moves but the camera, ratios are up to half of it on seven rendered cameras
that are registered well, with an object 5 to 125. On two excerpts of real recordings 3 of 242
registrations exceed it, with 5 at most; where depth is registered wrongly up to one of ten does,
until that is known."""

_LEAST_USUAL = 2.0  # chosen: normalised square that is usual anyway; noise alone gives 1
BETTER = 5.0  # chosen: ratio of the squares by which a pose agrees clearly better than another


class SensorAgreement:
    """
    Compares what keypoints and depth of one camera differ by to what is usual.

    :param noise: of the camera.
    """

    def __init__(self, noise: MeasuredNoise) -> None:
        self._noise = noise

    def is_lost_by(self, found: Registration, target: PreparedFrame) -> bool:
        """Return whether keypoints and depth differ far more than usual by a registration."""
        return self._is_lost(found.bias, found.tracks, target)

    def is_better_by(self, other: Refined, found: Registration) -> bool:
        """Return whether both differ far less by another pose, which keypoints confirm."""
        return other.is_confirmed and _is_far_less(other.bias, found.bias)

    def is_only_by(self, found: Registration, other: Refined, target: PreparedFrame) -> bool:
        """Return whether both differ far less than by another pose, by which it is unusual."""
        return (_is_far_less(found.bias, other.bias)
                and self._is_lost(other.bias, other.tracked, target))

    def _is_lost(self, bias: SensorBias | None, tracks: Tracks | None,
                 target: PreparedFrame) -> bool:
        if bias is None or tracks is None:
            return False
        motion = tracks.displacement(target.frame.camera.fx)
        usual = max(self._noise.usual_bias(motion), _LEAST_USUAL)
        return bias.least_normalised > _UNUSUAL * usual


def _is_far_less(bias: SensorBias | None, than: SensorBias | None) -> bool:
    return (bias is not None and than is not None
            and BETTER * bias.least_normalised < than.least_normalised)
