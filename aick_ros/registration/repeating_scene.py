# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Which of two poses is right where the scene repeats itself.

A row of equal shelves looks the same from several places. Keypoints may then confirm a pose that
is one shelf from the right one, and at a few frames per second a hand may have moved the camera
so far. So a registration far from the motion expected is refined once more, from that motion. If
the same keypoints confirm both poses, the images do not tell them apart, and the motion model
does: each is as likely as its acceleration. The variance of the choice adds to the covariance. If
more keypoints confirm the second pose, it is the right one. But if depth agrees with the keypoints
of only one of the two, that one is right: those of the other are on an object that moves. If depth
contradicts the second one nevertheless, the depth of one of the frames is wrong, and neither pose
is believed.

The motion that is expected may be wrong itself, by a mistake in the frame before. So it is taken
as no more certain than that frame agreed with what had been expected of it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.refinement.refinement import CONTRADICTION, Refined, Refinement
from aick_ros.registration.refinement.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.status import Status
from aick_ros.registration.unexpected_motion import (
    NEAR_POSE, is_same, sudden_accelerations, suddenness)
from aick_ros.settings import OdometrySettings

_FAR_LIKELIER = 0.9  # chosen: probability from which on the second of two poses is returned
_SAME_KEYPOINTS = 0.5  # chosen: share of a registration's keypoints that confirm another pose, too


class RepeatingSceneCheck:
    """
    Checks one camera's registrations, in time order, for scenes that repeat themselves.

    :param settings: the acceleration noise of the motion model.
    :param agreement: of the keypoints of the camera with its depth.
    """

    def __init__(self, refinement: Refinement, settings: OdometrySettings,
                 agreement: SensorAgreement) -> None:
        self._refinement = refinement
        self._agreement = agreement
        self._sudden = sudden_accelerations(settings)
        self._sigmas = np.repeat(
            [settings.acceleration_sigma, settings.angular_acceleration_sigma], 3)
        self._shown = np.zeros(6)  # apparent acceleration of the frame before
        self._last = 0, np.zeros(6)  # stamp and apparent acceleration of the last frame

    def check_first(self, found: Registration, source: PreparedFrame,
                    target: PreparedFrame) -> Registration:
        """Return a registration as it is, where no motion is expected: rest is the reference."""
        interval = abs(seconds(target.stamp, source.stamp))
        if found.status.ok and interval > 0.0:
            self._note(source.stamp, se3.difference(found.T_target_source, np.eye(4)), interval)
        return found

    def check(self, found: Registration, source: PreparedFrame, target: PreparedFrame,
              expected: np.ndarray, elapsed: float) -> Registration:
        """
        Return the registration, or a likelier one that keypoints confirm as well.

        :param expected: ``T_target_source`` at constant velocity, 4x4.
        :param elapsed: time since the velocity was measured [s].
        """
        chosen = self._of_two(found, source, target, expected, elapsed)
        if chosen.status.ok:
            self._note(source.stamp, se3.difference(chosen.T_target_source, expected), elapsed)
        return chosen

    def _of_two(self, found: Registration, source: PreparedFrame, target: PreparedFrame,
                expected: np.ndarray, elapsed: float) -> Registration:
        change = se3.inverse(expected) @ found.T_target_source
        if (is_same(expected, found.T_target_source, NEAR_POSE)
                and suddenness(change, elapsed, self._sudden) <= 1.0
                or source.grey.shape != target.grey.shape):
            return found
        other = self._refinement.refine(source, target, expected)
        if is_same(found.T_target_source, other.T_target_source):
            return found
        if (self._agreement.is_lost_by(found, target)
                and self._agreement.is_better_by(other, found)):
            return _replaced(found, other)
        if self._agreement.is_only_by(found, other, target):
            return found
        confirming = FEWEST_TO_CONFIRM if found.tracks is None else found.support
        if other.is_contradicted and len(other.tracked) > confirming:
            return failed(Status.TOO_FEW_MATCHES, CONTRADICTION)
        if _is_confirmed_alike(found, other):
            shown = self._shown if source.stamp == self._last[0] else self._last[1]
            sigmas = 0.5 * np.hypot(self._sigmas, shown) * elapsed ** 2
            return _likelier(found, other, _share_of_second(
                [se3.difference(pose.T_target_source, expected) / sigmas
                 for pose in (found, other)]))
        if len(other.tracked) > max(found.support, FEWEST_TO_CONFIRM):
            return _replaced(found, other)
        return found

    def _note(self, stamp: int, deviation: np.ndarray, elapsed: float) -> None:
        """Note the acceleration that a frame shows; it may be registered several times."""
        if stamp != self._last[0]:
            self._shown = self._last[1]
        self._last = stamp, 2.0 * deviation / elapsed ** 2


def _share_of_second(deviations: list[np.ndarray]) -> float:
    """Return the probability of the second of two deviations, each whitened."""
    first, second = (float(deviation @ deviation) for deviation in deviations)
    return float(1.0 / (1.0 + np.exp(np.clip(0.5 * (second - first), -700.0, 700.0))))


def _is_confirmed_alike(found: Registration, other: Refined) -> bool:
    """Return whether the same keypoints confirm two poses, not some one and some the other."""
    if found.tracks is None:
        return False
    common = np.isin(found.tracks.keypoints, other.tracked.keypoints)
    return int(common.sum()) >= _SAME_KEYPOINTS * found.support


def _likelier(found: Registration, other: Refined, share: float) -> Registration:
    """
    Return a registration or a pose that is far likelier, with the variance of the choice.

    :param share: probability of the other pose.
    """
    difference = se3.difference(found.T_target_source, other.T_target_source)
    chosen, doubt = found, share
    if share > _FAR_LIKELIER:
        chosen, doubt = _replaced(found, other), 1.0 - share
    return dataclasses.replace(
        chosen, covariance=chosen.covariance + doubt * np.outer(difference, difference),
        reason=f'{chosen.reason}; the scene repeats itself after '
               f'{np.linalg.norm(difference[:3]):.2f} m')


def _replaced(found: Registration, other: Refined) -> Registration:
    """Return a registration with another pose that keypoints confirm."""
    reason = f'{found.reason}; {len(other.tracked)} tracked where the motion continues'
    return dataclasses.replace(other.applied_to(found, reason), matches=found.matches[:0],
                               evidence=Evidence.KEYPOINTS)
