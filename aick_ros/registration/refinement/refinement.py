# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The last step of a registration: one least-squares problem of keypoints and depth image.

Keypoints hold the rotation, the depth image holds the translation. Both enter a Gauss-Newton
iteration on SE(3) with robust weights, each in units of its own noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.refinement.residuals import (
    NormalEquations, Residuals, gradient_noise, point_to_plane, reprojection, track_depth)
from aick_ros.registration.refinement.tracks import Tracker, Tracks
from aick_ros.registration.result import Disagreement
from aick_ros.settings import RefinementSettings, SensorSettings

_COARSE = 1  # iterations with wide robust weights, by the keypoints alone
_COARSE_WIDTH = 3.0  # times the final one
_STILL = 2e-5  # m and rad; a smaller step ends the iteration
_FEWEST, _FEW = 7, 0.5
"""Tracks that make a pose better, and share up to which they are sought again from there."""

_WEAK = np.eye(6)  # 1 m and 1 rad: keeps finite what nothing tells about


@dataclass(frozen=True, eq=False)
class Refined:
    """
    A refined pose.

    :param T_target_source: 4x4 [m].
    :param covariance: 6x6, of the noise alone [m^2, m rad, rad^2].
    :param tracked: keypoints of the source that the target sees where the pose puts them.
    :param disagreement: of the two sensors; None where only one is used.
    """

    T_target_source: np.ndarray
    covariance: np.ndarray
    tracked: Tracks
    disagreement: Disagreement | None


class Refinement:
    """Improves a first pose; see :class:`RefinementSettings`."""

    def __init__(self, settings: RefinementSettings, sensor: SensorSettings) -> None:
        self._settings = settings
        self._sensor = sensor
        self._tracker = Tracker(settings, sensor)

    def refine(self, source: PreparedFrame, target: PreparedFrame, T_target_source: np.ndarray) -> Refined:
        """
        Return the pose that explains both images best.

        :param T_target_source: from where to begin, within some ten pixels.
        """
        tracks = self._tracker.track(source, target, T_target_source)
        refined = self._solved(source, target, tracks, T_target_source)
        sought = min(len(source.keypoints), self._settings.max_tracks)
        if _FEWEST <= len(tracks) and len(refined.tracked) < _FEW * sought:
            tracks = self._tracker.track(source, target, refined.T_target_source)
            refined = self._solved(source, target, tracks, refined.T_target_source)
        return refined

    def _solved(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks, pose: np.ndarray) -> Refined:
        problem = _Problem(source, target, tracks, self._settings, self._sensor)
        for i in range(self._settings.iterations - 1):
            step = problem.step(pose, coarse=i < _COARSE)
            pose = se3.perturbed(pose, step)
            if i > _COARSE and np.abs(step).max() < _STILL:
                break
        return problem.finished(pose)


class _Problem:
    """What is known of one pair of views, at any pose."""

    def __init__(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks, settings: RefinementSettings,
                 sensor: SensorSettings) -> None:
        self._tracks = tracks
        self._surfaces = source.surface, target.surface
        self._rate = _rate_of_depth(source, target)
        self._ray_sigma = settings.track_sigma / target.frame.camera.fx
        self._settings = settings
        self._sensor = sensor

    def step(self, pose: np.ndarray, coarse: bool) -> np.ndarray:
        """Return the error of a pose by Gauss and Newton, 6; keypoints come first."""
        kinds = self._by_keypoints(pose, _COARSE_WIDTH if coarse else 1.0)
        if not coarse or not len(self._tracks):
            kinds += self._by_depth(pose)
        equations = NormalEquations.of(kinds)
        return -np.linalg.solve(equations.information + _WEAK, equations.gradient)

    def finished(self, pose: np.ndarray) -> Refined:
        """Return the pose after a last step, with what can be said of it."""
        kinds = self._by_keypoints(pose), self._by_depth(pose)
        equations = [NormalEquations.of(kind) for kind in kinds]
        noises = [gradient_noise(kind) + _WEAK for kind in kinds]
        covariance = np.linalg.inv(sum(part.information for part in equations) + _WEAK)
        step = -covariance @ sum(part.gradient for part in equations)
        good = kinds[0][0].weights[:len(self._tracks)] > 0.25
        return Refined(se3.perturbed(pose, step), covariance @ sum(noises) @ covariance,
                       self._tracks[good], _disagreement(equations, noises) if kinds[1] else None)

    def _by_keypoints(self, pose: np.ndarray, widen: float = 1.0) -> list[Residuals]:
        width = widen * self._settings.robust_width
        return [reprojection(self._tracks, pose, self._ray_sigma, width),
                track_depth(self._tracks, pose, self._sensor, width)]

    def _by_depth(self, pose: np.ndarray) -> list[Residuals]:
        if None in self._surfaces:
            return []
        # between the depth images passed more or less time than between the colour images
        return [point_to_plane(*self._surfaces, se3.scaled(pose, self._rate), self._sensor,
                               self._settings.robust_width, self._settings.reach
                               ).times(self._rate)]


def _disagreement(equations: Sequence[NormalEquations],
                  noises: Sequence[np.ndarray]) -> Disagreement:
    """Return where keypoints and depth images pull a pose that suits both."""
    own = [np.linalg.inv(part.information + _WEAK) for part in equations]
    pulls = [inverse @ part.gradient for inverse, part in zip(own, equations)]
    return Disagreement(pulls[1] - pulls[0],
                        sum(inverse @ noise @ inverse for inverse, noise in zip(own, noises)))


def _rate_of_depth(source: PreparedFrame, target: PreparedFrame) -> float:
    """Return the time between two depth images as a share of that between the colour images."""
    interval = (source.stamp - target.stamp) / NANOSECONDS
    if interval == 0.0:
        return 1.0
    rate = 1.0 + (source.depth_lag - target.depth_lag) / interval
    return rate if 0.0 < rate < 2.0 else 1.0
