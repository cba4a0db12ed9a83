# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether a sudden motion is the camera's, or that of something that moves before it.

A registration finds the motion that most keypoints share. Where a bus passes they are on the bus.
It moves at once by metres a second, which no hand does to a camera; and the street behind it
stays where it was. So where a motion is more sudden than a hand's, what is left without its
keypoints is registered once more, from where the camera would be at constant velocity, and the
images decide between the two.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.registration.pose_vote import PoseVote, pose_vote
from aick_ros.registration.refinement.refinement import Refined, Refinement
from aick_ros.registration.result import Evidence, Registration
from aick_ros.settings import SensorSettings

_SUDDEN = 15.0, 30.0
"""What changes of the motion by a hand stay below, with stamps that jitter [m/s^2, rad/s^2]."""

_HAND = np.repeat([5.0, 15.0], 3)
"""Standard deviation of such changes [m/s^2, rad/s^2]."""

_FEWEST_TRACKS = 12  # fewer do not tell about a pose; the depth image alone does then
_ALIKE = 0.015, np.radians(0.8)  # m and rad; poses nearer to each other are the same
_SEEN = 0.6  # of the surfaces must be in view of both poses
_LEAST = 0.07  # of the view must be for the second pose
_MAJORITY, _MINORITY = 0.6, 0.1
"""Share of the view that must be for the second pose where a motion is just more sudden than a
hand's, and where it is far more."""


class DynamicObjectCheck:
    """Doubts registrations whose motion comes all of a sudden."""

    def __init__(self, refinement: Refinement, sensor: SensorSettings) -> None:
        self._refinement = refinement
        self._sensor = sensor

    def check(self, found: Registration, source: PreparedFrame, target: PreparedFrame, expected: np.ndarray,
           elapsed: float) -> Registration:
        """
        Return the registration, or the one that more speaks for.

        Where it is not clear which, the difference becomes part of the covariance.

        :param expected: ``T_target_source`` at constant velocity.
        :param elapsed: for how long the velocity was not seen [s].
        """
        sudden = suddenness(se3.inverse(expected) @ found.T_target_source, elapsed)
        if (sudden <= 1.0 or None in (source.surface, target.surface)
                or source.grey.shape != target.grey.shape):
            return found
        movers = [] if found.tracks is None else found.tracks.keypoints
        refined = self._without(movers, source, target, expected)
        second, covariance = _fused(expected, np.diag((0.5 * _HAND * elapsed ** 2) ** 2), refined)
        apart = se3.inverse(found.T_target_source) @ second
        if (np.linalg.norm(apart[:3, 3]) < _ALIKE[0]
                and se3.angle(apart[:3, :3]) < _ALIKE[1]):
            return found
        ballot = pose_vote(source, target, found.T_target_source, second, self._sensor)
        if not _is_for_second(ballot, sudden):
            return _doubted(found, second, ballot)
        return dataclasses.replace(
            found, T_target_source=second, covariance=covariance, matches=found.matches[:0],
            bias=refined.bias, tracks=refined.tracked,
            support=len(refined.tracked), evidence=Evidence.DEPTH,
            reason=f'{found.support} keypoints move by themselves, {ballot.second:.0%} of the '
                   'view shows another motion')

    def _without(self, keypoints: np.ndarray, source: PreparedFrame, target: PreparedFrame,
                 expected: np.ndarray) -> Refined:
        """Return the pose by all but some keypoints of the source."""
        rest = np.setdiff1d(np.arange(len(source.keypoints)), keypoints)
        refined = self._refinement.refine(_of_keypoints(source, rest), target, expected)
        if len(refined.tracked) < _FEWEST_TRACKS:
            refined = dataclasses.replace(self._refinement.refine(
                _of_keypoints(source, rest[:0]), target, expected), bias=None)
        tracks = refined.tracked
        return dataclasses.replace(
            refined, tracked=dataclasses.replace(tracks, keypoints=rest[tracks.keypoints]))


def suddenness(change: np.ndarray, elapsed: float) -> float:
    """
    Return how sudden a change of the motion is; 1 is the most that a hand does.

    :param change: 4x4, from where the camera would be at constant velocity to where it is.
    :param elapsed: the time in which it happened [s].
    """
    way = np.linalg.norm(change[:3, 3]), se3.angle(change[:3, :3])
    return float(np.max(np.divide(way, _SUDDEN))) / elapsed ** 2


def _is_for_second(ballot: PoseVote, sudden: float) -> bool:
    needed = max(_MINORITY, _MAJORITY * np.exp(0.5 * (1.0 - sudden)))
    return ballot.seen > _SEEN and ballot.second > _LEAST and ballot.for_second > needed


def _doubted(found: Registration, second: np.ndarray, ballot: PoseVote) -> Registration:
    """Return a registration that may be wrong: the variance is that of a choice of two."""
    off = se3.difference(found.T_target_source, second)
    return dataclasses.replace(
        found, covariance=found.covariance + ballot.for_second * np.outer(off, off))


def _fused(expected: np.ndarray, prior: np.ndarray,
           refined: Refined) -> tuple[np.ndarray, np.ndarray]:
    """Return a pose and its covariance where what is seen does not hold all of it."""
    gain = prior @ np.linalg.inv(prior + refined.covariance)
    step = gain @ se3.difference(refined.T_target_source, expected)
    covariance = (np.eye(6) - gain) @ prior
    return se3.perturbed(expected, step), 0.5 * (covariance + covariance.T)


def _of_keypoints(view: PreparedFrame, chosen: np.ndarray) -> PreparedFrame:
    """Return a view with some of its keypoints."""
    keypoints = view.keypoints
    return dataclasses.replace(view, keypoints=dataclasses.replace(
        keypoints, words=None, **{name: getattr(keypoints, name)[chosen] for name in (
            'positions', 'descriptors', 'covariances', 'pixels')}))
