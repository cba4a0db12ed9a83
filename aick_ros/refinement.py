# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The last step of a registration: one least-squares problem of keypoints and depth image.

Keypoints hold the rotation, the depth image holds the translation. Both enter a Gauss-Newton
iteration on SE(3) with robust weights, each in units of its own noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import rigid
from aick_ros.aick import Disagreement
from aick_ros.residuals import NormalEquations, point_to_plane, reprojection, track_depth
from aick_ros.settings import RefinementSettings, SensorSettings
from aick_ros.tracks import Tracker, Tracks
from aick_ros.trajectory import NANOSECONDS
from aick_ros.view import View

_COARSE = 2  # iterations with wide robust weights, by the keypoints alone
_COARSE_WIDTH = 3.0  # times the final one
_STILL = 1e-6  # m and rad; a smaller step ends the iteration
_WEAK = np.eye(6)  # 1 m and 1 rad: keeps finite what nothing tells about


@dataclass(frozen=True, eq=False)
class Refined:
    """
    A refined pose.

    :param T_target_source: 4x4 [m].
    :param covariance: 6x6, of the noise alone [m^2, m rad, rad^2].
    :param tracked: keypoints of the source that were found in the target.
    :param disagreement: of the two sensors; None where only one is used.
    """

    T_target_source: np.ndarray
    covariance: np.ndarray
    tracked: np.ndarray
    disagreement: Disagreement | None


class Refinement:
    """Improves a first pose; see :class:`RefinementSettings`."""

    def __init__(self, settings: RefinementSettings, sensor: SensorSettings) -> None:
        self._settings = settings
        self._sensor = sensor
        self._tracker = Tracker(settings, sensor)

    def refine(self, source: View, target: View, T_target_source: np.ndarray) -> Refined:
        """
        Return the pose that explains both images best.

        :param T_target_source: from where to begin, within some ten pixels.
        """
        problem = _Problem(source, target, self._tracker.track(source, target, T_target_source),
                           self._settings, self._sensor)
        pose = T_target_source
        for i in range(self._settings.iterations):
            tracked = problem.tracked(pose, _COARSE_WIDTH if i < _COARSE else 1.0)
            ranged = problem.ranged(pose) if i >= _COARSE or not len(problem.tracks) else _NOTHING
            step = -np.linalg.solve(tracked.information + ranged.information + _WEAK,
                                    tracked.gradient + ranged.gradient)
            pose = rigid.perturbed(pose, step)
            if i > _COARSE and np.abs(step).max() < _STILL:
                break
        return problem.judged(pose)


class _Problem:
    """What is known of one pair of views, as normal equations at any pose."""

    def __init__(self, source: View, target: View, tracks: Tracks, settings: RefinementSettings,
                 sensor: SensorSettings) -> None:
        self.tracks = tracks
        self._surfaces = source.surface, target.surface
        self._rate = _rate_of_depth(source, target)
        self._ray_sigma = settings.track_sigma / target.frame.camera.fx
        self._settings = settings
        self._sensor = sensor

    def tracked(self, pose: np.ndarray, width: float = 1.0) -> NormalEquations:
        """Return what the keypoints tell; the robust weights are wider by a factor."""
        width *= self._settings.robust_width
        return NormalEquations.of(
            reprojection(self.tracks, pose, self._ray_sigma, self._sensor, width),
            track_depth(self.tracks, pose, self._sensor, width))

    def ranged(self, pose: np.ndarray) -> NormalEquations:
        """Return what the depth images tell."""
        if None in self._surfaces:
            return _NOTHING
        # between the depth images passed more or less time than between the colour images
        return NormalEquations.of(point_to_plane(
            *self._surfaces, rigid.scaled(pose, self._rate), self._sensor,
            self._settings.robust_width, self._settings.reach)).times(self._rate)

    def judged(self, pose: np.ndarray) -> Refined:
        """Return the pose with what can be said of it."""
        tracked, ranged = self.tracked(pose), self.ranged(pose)
        covariance = np.linalg.inv(tracked.information + ranged.information + _WEAK)
        noise = tracked.noise + ranged.noise + _WEAK
        pulls = None
        if ranged.information.any():
            own = [np.linalg.inv(terms.information + _WEAK) for terms in (tracked, ranged)]
            pulls = Disagreement(
                own[1] @ ranged.gradient - own[0] @ tracked.gradient,
                sum(c @ (terms.noise + _WEAK) @ c for c, terms in zip(own, (tracked, ranged))))
        return Refined(pose, covariance @ noise @ covariance, self.tracks.keypoints, pulls)


def _rate_of_depth(source: View, target: View) -> float:
    """Return the time between two depth images as a share of that between the colour images."""
    interval = (source.stamp - target.stamp) / NANOSECONDS
    if interval == 0.0:
        return 1.0
    rate = 1.0 + (source.depth_lag - target.depth_lag) / interval
    return rate if 0.0 < rate < 2.0 else 1.0


_NOTHING = NormalEquations.of()
