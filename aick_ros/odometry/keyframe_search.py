# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Finding an earlier keyframe again.

Places that look alike are the danger: one false reuse bends the whole trajectory. So an earlier
keyframe is only sought where the graph expects it, must be found there by its appearance alone,
without that expectation as initial guess, and two of them must agree with each other and with the
graph.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import definite, se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.keyframe_graph import KeyframeGraph, RelativePose
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.settings import OdometrySettings, Settings

WITNESSES = 2  # by definition: keyframes that must agree
_MIN_TRACKED = 0.35  # chosen on rendered rooms: share of the keypoints that must be tracked
MAX_SIGMA = 0.15  # m; chosen: 3 sigma is less than the spacing of repeated furniture
_FAR, _MOST_SIGMAS = 0.15, 3.0
"""Error of the expected position from which on it must be within so many standard deviations [m].

Chosen: less than half of that spacing. What is nearer is not mistaken for another place, and the
covariance of a long way may well be too small."""


class KeyframeSearch:
    """
    Compares a keyframe with two earlier ones, a part of a registration at a time.

    :param key: of the keyframe; ``candidates``: keys of the earlier ones.
    :ivar missed: key of the one that the images do not show; None: there is none so far.
    """

    def __init__(self, key: int, candidates: tuple[int, ...]) -> None:
        self.key = key
        self.missed: int | None = None
        self._pending = list(candidates)
        self._aligned: Registration | None = None  # to the first of those pending
        self._found: list[RelativePose] = []
        self.keys = frozenset((key, *candidates))

    @property
    def is_finished(self) -> bool:
        """The end of the search: no registration is left to do."""
        return not self._pending

    @property
    def candidate(self) -> int:
        """Key of the earlier one that is compared now."""
        return self._pending[0]

    @property
    def has_begun(self) -> bool:
        """A registration is begun, and not done yet."""
        return self._aligned is not None

    @property
    def found(self) -> tuple[int, ...]:
        """Keys of the earlier ones that the images show, wherever they do."""
        return tuple(measurement.first for measurement in self._found)

    def step(self, graph: KeyframeGraph, frames: Mapping[int, PreparedFrame],
             registrar: Registrar, settings: Settings) -> tuple[RelativePose, ...]:
        """
        Do a part of a registration: AICK, or a refinement that confirms it.

        Where keypoints are tracked twice there are two of these.

        :returns: the measurements that are accepted, with the last registration; until then none.
        """
        candidate, source = self.candidate, frames[self.key]
        if self._aligned is None:
            self._aligned = registrar.align(source, frames[candidate])
            if not self._aligned.status.ok:
                self._miss(candidate)
            return ()
        registration = registrar.recognize_partly(source, frames[candidate], self._aligned)
        self._aligned = registration if registration.is_rough else None
        if registration.is_rough:
            return ()
        if not _is_tracked(registration, source, settings):
            self._miss(candidate)
            return ()
        self._pending.pop(0)
        measurement = RelativePose(candidate, self.key, registration.pose)
        self._found.append(measurement)
        largest = LARGEST_SQUARED_DISTANCES[6 * len(self._found)]
        if (graph.squared_distance(self._found) > largest
                or not _is_near(measurement, graph.relative(candidate, self.key))):
            self._pending.clear()
            return ()
        return tuple(self._found) if self.is_finished else ()

    def _miss(self, candidate: int) -> None:
        """End the search, as the images do not show a keyframe."""
        self.missed = candidate
        self._pending.clear()


def candidates(graph: KeyframeGraph, key: int, stamps: Mapping[int, int],
               settings: OdometrySettings) -> tuple[int, ...]:
    """
    Return the two earlier keyframes that a keyframe is most likely to see again, or none.

    Keyframes whose relative position is less certain are not sought: the graph could not
    distinguish two places that look alike.
    """
    limit = stamps[key] - settings.reuse_age * NANOSECONDS
    apart = view_distances(graph.matrices, graph.pose(key).matrix[None], settings)[:, 0]
    # by stamp: a frame that became a keyframe twice is one witness, and none of itself
    near = sorted({stamps[other]: (distance, other)
                   for distance, other in zip(apart, graph.keys)
                   if stamps[other] <= limit and stamps[other] != stamps[key]
                   and distance < 1.0}.values())
    certain = [other for _, other in near[:2 * WITNESSES]
               if np.trace(graph.relative(other, key).covariance[:3, :3])
               < MAX_SIGMA ** 2]
    return tuple(certain[:WITNESSES]) if len(certain) >= WITNESSES else ()


def view_distances(poses: np.ndarray, others: np.ndarray,
                   settings: OdometrySettings) -> np.ndarray:
    """
    Return how far views are from other ones, NxM; 1 is the farthest that is sought.

    :param poses: ``T_odom_camera``, Nx4x4; ``others``: Mx4x4.
    """
    distances = np.linalg.norm(poses[:, None, :3, 3] - others[:, :3, 3], axis=2)
    rotations, other_rotations = (views[:, :3, :3].reshape(-1, 9) for views in (poses, others))
    traces = rotations @ other_rotations.T  # of R^T R', each as the sum of nine products
    angles = np.arccos(np.clip((traces - 1.0) / 2.0, -1.0, 1.0))
    apart: np.ndarray = np.hypot(distances / settings.reuse_distance,
                                 angles / settings.reuse_angle)
    return apart


def _is_near(measurement: RelativePose, expected: PoseWithCovariance) -> bool:
    """Return whether a keyframe is seen from where that is expected, and not one piece beside."""
    error = se3.difference(measurement.pose.matrix, expected.matrix)[:3]
    covariance = (measurement.pose.covariance + expected.covariance)[:3, :3]
    return bool(np.linalg.norm(error) < _FAR
                or error @ definite.solve(covariance, error) < _MOST_SIGMAS ** 2)


def _is_tracked(registration: Registration, source: PreparedFrame, settings: Settings) -> bool:
    """Return whether the image confirms a registration."""
    if not registration.status.ok or registration.tracks is None:
        return False
    sought = settings.refinement.sought(len(source.keypoints))
    return registration.support >= _MIN_TRACKED * sought
