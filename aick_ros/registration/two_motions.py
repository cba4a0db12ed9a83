# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Which of two motions is that of the camera, where two frames show both.

Of a scene with an object that moves by itself some keypoints confirm one pose, and the others
another one. Each has its own depth that agrees with it. The camera has not moved suddenly; more
keypoints and more of the surfaces are on the scene than on an object, as a rule; and an object
hides a part of the scene, which is farther; what has moved shortly before may move still. None of
that is certain, so the evidence is added up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.registration.refinement.residuals import are_far_smaller
from aick_ros.registration.result import Fit, Registration, SensorBias
from aick_ros.registration.sensor_agreement import BETTER
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM

_LEAST_SHARE = 0.15  # chosen: of the keypoints that confirm one alone, for the weaker one

# Evidence, each by which one motion outweighs another. Chosen on rendered rooms through which
# boards, people, cartons and posters move, with 10 to 70 % of the keypoints.
_SUDDEN, _LARGEST_DIFFERENCE = 1.2, 24.0  # of squared deviations from the motion expected
_KEYPOINTS, _SURFACES, _THREE_TIMES = 0.8, 0.4, math.log(3.0)
_TWICE_AS_FAR = 1.0
_KNOWN = 1.5  # all keypoints of one of them on what has moved before


@dataclass(frozen=True)
class TwoMotions:
    """
    Two motions that two frames show.

    :param first: number of keypoints that confirm the first one alone.
    :param second: likewise, of the second one.
    :param evidence: that the second one is the camera's; that the first one is where negative.
    :param alike: number of keypoints that confirm both as well.
    """

    first: int
    second: int
    evidence: float
    alike: int = 0

    @classmethod
    def of(cls, first: Registration, second: Registration, expected: np.ndarray,
           sigmas: np.ndarray) -> TwoMotions | None:
        """
        Return what two registrations of one pair of frames show, None without their tracks.

        :param expected: ``T_target_source`` at constant velocity or by other sensors, 4x4.
        :param sigmas: 6, of the difference from that [m, rad].
        """
        if (first.tracks is None or second.tracks is None or first.fit is None
                or second.fit is None):
            return None
        (for_first, for_second), alike = _votes(
            (first.tracks.keypoints, second.tracks.keypoints), (first.fit, second.fit))
        counts = int(for_first.sum()), int(for_second.sum())
        if min(counts) == 0:
            return cls(*counts, math.copysign(math.inf, counts[1] - counts[0]), alike)
        depths = [float(np.median(tracks.points[votes, 2])) for tracks, votes in (
            (first.tracks, for_first), (second.tracks, for_second))]
        deviations = [se3.difference(each.T_target_source, expected) / sigmas
                      for each in (first, second)]
        suddenness = float(deviations[0] @ deviations[0] - deviations[1] @ deviations[1])
        return cls(*counts, (
            math.log(_bias(first.bias) / _bias(second.bias)) / math.log(BETTER)
            + _SUDDEN * min(max(suddenness / _LARGEST_DIFFERENCE, -1.0), 1.0)
            + _KEYPOINTS * math.log(counts[1] / counts[0]) / _THREE_TIMES
            + _SURFACES * math.log(_share(second.fit) / _share(first.fit)) / _THREE_TIMES
            + _KNOWN * (first.fit.known_share - second.fit.known_share)
            + _TWICE_AS_FAR * math.log2(depths[1] / depths[0])), alike)

    @property
    def weaker_share(self) -> float:
        """Share of the keypoints, of those that confirm one motion alone, for the weaker one."""
        return min(self.first, self.second) / max(self.first + self.second, 1)

    @property
    def are_confirmed(self) -> bool:
        """Support of both motions by enough keypoints."""
        return (min(self.first, self.second) > FEWEST_TO_CONFIRM
                and self.weaker_share > _LEAST_SHARE)


def _votes(keypoints: tuple[np.ndarray, np.ndarray], fits: tuple[Fit, Fit]
           ) -> tuple[tuple[np.ndarray, np.ndarray], int]:
    """Return which keypoints of two poses confirm one alone, or far better, and how many both."""
    _, *common = np.intersect1d(*keypoints, assume_unique=True, return_indices=True)
    votes = np.ones(len(keypoints[0]), bool), np.ones(len(keypoints[1]), bool)
    first, second = (fit.squared_errors[rows] for fit, rows in zip(fits, common))
    votes[0][common[0]] = are_far_smaller(first, second)
    votes[1][common[1]] = are_far_smaller(second, first)
    alike = int(np.count_nonzero(~votes[0][common[0]] & ~votes[1][common[1]]))
    return votes, alike


def _bias(bias: SensorBias | None) -> float:
    """Return the square of a bias between keypoints and depth; 1, as of noise, without one."""
    return 1.0 if bias is None else max(bias.least_normalised, 1.0)


def _share(fit: Fit) -> float:
    return max(fit.scene_share, 0.01)
