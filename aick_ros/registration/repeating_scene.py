# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Which of two poses is right where the scene repeats itself.

A row of equal shelves looks the same from several places. Keypoints may then confirm a pose that
is one shelf from the right one, and at a few frames per second a hand may have moved the camera
so far. So a registration far from the motion expected is refined once more, from that motion. If
the same keypoints confirm both poses, the images do not tell them apart, and the motion model
does: each is as likely as its acceleration. The variance of the choice adds to the covariance. If
depth agrees with the keypoints of only one of the two, that one is right: those of the other are
on an object that moves. If some keypoints confirm one pose, others the second one, and few of them
both, the scene does not repeat itself but shows two motions; if few confirm one, the other one is
right. If depth contradicts the second one nevertheless, the depth of one of the frames is wrong,
and both poses are rejected.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.refined import CONTRADICTION, Refined
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.two_motions import TwoMotions
from aick_ros.registration.unexpected_motion import is_continued, is_same, sudden_accelerations
from aick_ros.settings import OdometrySettings

_FAR_LIKELIER = 0.9  # chosen: probability from which on the second of two poses is returned
_SAME_KEYPOINTS, _AS_WELL = 0.5, 0.3
"""Share of a registration's keypoints that confirm another pose, too; and share, of those of the
pose that more confirm, that confirm both as well.

Chosen: in rendered rooms that repeat themselves the second is 0.44 and more, unless the other pose
is rough; where objects move or the camera is shaken it is 0.08 at most."""


class RepeatingSceneCheck:
    """
    Checks one camera's registrations, in time order, for scenes that repeat themselves.

    :param settings: the acceleration noise of the motion model.
    :param agreement: of the keypoints of the camera with its depth.
    :param acceleration: that frames have shown.
    """

    def __init__(self, refinement: Refinement, settings: OdometrySettings,
                 agreement: SensorAgreement, acceleration: ApparentAcceleration) -> None:
        self._refinement = refinement
        self._agreement = agreement
        self._acceleration = acceleration
        self._sudden = sudden_accelerations(settings)

    def check(self, found: Registration, source: PreparedFrame, target: PreparedFrame,
              expected: ExpectedPose) -> Registration:
        """Return the registration, or a likelier one that keypoints confirm as well."""
        if (is_continued(found.T_target_source, expected, self._sudden)
                or source.grey.shape != target.grey.shape):
            return found
        other = self._refinement.refine(source, target, expected.T_target_source)
        if is_same(found.T_target_source, other.T_target_source):
            return found
        if (self._agreement.is_lost_by(found, target)
                and self._agreement.is_better_by(other, found)):
            return _replaced(found, other)
        if self._agreement.is_only_by(found, other, target):
            return found
        return self._by_keypoints(found, other, expected.T_target_source,
                                  self._acceleration.sigmas(source.stamp, expected))

    def _by_keypoints(self, found: Registration, other: Refined, expected: np.ndarray,
                      sigmas: np.ndarray) -> Registration:
        """Return the registration, or the other pose, by their keypoints and the motion model."""
        motions = TwoMotions.of(found, other.applied_to(found, ''), expected, sigmas)
        are_alike = False
        if motions is not None and other.is_confirmed:
            larger = max(found.support, len(other.tracked))
            are_alike = motions.alike >= max(_AS_WELL * larger, FEWEST_TO_CONFIRM)
            if motions.are_confirmed and not are_alike:
                return _replaced(found, other) if motions.evidence > 0.0 else found
        confirming = FEWEST_TO_CONFIRM if found.tracks is None else found.support
        if other.is_contradicted and len(other.tracked) > confirming:
            return failed(Status.TOO_FEW_MATCHES, CONTRADICTION)
        if are_alike or _are_confirmed_by_the_same(found, other):
            return _likelier(found, other, _share_of_second(
                [se3.difference(pose.T_target_source, expected) / sigmas
                 for pose in (found, other)]))
        counts = ((found.support, len(other.tracked)) if motions is None
                  else (motions.first, motions.second))
        return _replaced(found, other) if counts[1] > max(counts[0], FEWEST_TO_CONFIRM) else found


def _share_of_second(deviations: list[np.ndarray]) -> float:
    """Return the probability of the second of two deviations, each whitened."""
    first, second = (float(deviation @ deviation) for deviation in deviations)
    return float(1.0 / (1.0 + np.exp(np.clip(0.5 * (second - first), -700.0, 700.0))))


def _are_confirmed_by_the_same(found: Registration, other: Refined) -> bool:
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
    chosen, weight = found, share
    if share > _FAR_LIKELIER:
        chosen, weight = _replaced(found, other), 1.0 - share
    return dataclasses.replace(
        chosen, covariance=chosen.covariance + weight * np.outer(difference, difference),
        reason=f'{chosen.reason}; the scene repeats itself after '
               f'{np.linalg.norm(difference[:3]):.2f} m')


def _replaced(found: Registration, other: Refined) -> Registration:
    """Return a registration with another pose that keypoints confirm."""
    reason = f'{found.reason}; {len(other.tracked)} tracked where the motion continues'
    return dataclasses.replace(other.applied_to(found, reason), matches=found.matches[:0],
                               evidence=Evidence.KEYPOINTS)
