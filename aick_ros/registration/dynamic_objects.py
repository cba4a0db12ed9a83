# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether a motion is that of the camera, or of an object in front of it.

A registration finds the motion that most keypoints share. Where a bus passes, most are on the
bus: it appears to accelerate the camera by more than the motion model allows, the surfaces of the
street behind it contradict the motion, or the street seems to be an object that moves by itself.
If surfaces contradict the motion until a few keypoints and the depth around them are ignored,
those are on an object. Otherwise the frame is registered once more without the keypoints of the
first registration and the depth around them, from the pose at constant velocity. If keypoints and
depth agree far better there, that is the motion of the camera. If many keypoints confirm each of
the two, all evidence about them is added up. Either counts only where the two differ by more than
both may err. If not, and the first motion is that of objects which have moved before, it is
rejected; if it is sudden, the images decide between the two poses. If nothing shows another motion
than objects that have moved before, and theirs does not continue the one expected, none is found.

If a poster moves in front of a distant wall, one camera motion (a rotation with a translation)
can fit the tracks on both. So if the motion found exceeds the motion prior, the frame is
registered again without the tracks on known objects (with them, if few others are left). Where
only that pose agrees with the prior, it is accepted.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import differ, fused
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.motion_prior import MotionPrior
from aick_ros.registration.pose_vote import PoseVote, pose_vote
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.result import Evidence, Fit, Registration, failed
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.two_motions import TwoMotions
from aick_ros.registration.unexpected_motion import is_same, sudden_accelerations, suddenness
from aick_ros.settings import Settings

# All chosen on rendered rooms with boards that move through 10 to 60 % of the view.
_LEAST_SEEN = 0.6  # share of the surfaces that both poses must put into view
_LEAST_FOR_SECOND = 0.07  # share of the view that must support the second pose
_LEFT_SHARE = 0.5  # of the keypoints found, that must be left without a small object
_FEW_LEFT = 0.1  # keypoints of the rest by those found; fewer may agree with depth by chance
_FEW_KNOWN = 0.3  # share of the keypoints of the scene that may be on what has moved before
_LONGEST_ALONE = 0.1  # s; chosen: time after which the motion expected hardly excludes any other
_LEAST_OF_SCENE = 0.02  # share of the points of depth that must be those of the scene
_CERTAIN_SHARE = 0.25  # of the keypoints, for either of two motions: the images need no vote then
_MAJORITY, _MINORITY = 0.6, 0.1
"""Share of the votes that the second pose needs: of a motion that is just sudden, and at least."""

# Both chosen on rendered rooms with boards that move through two thirds of the view.
_SCENE_RATIO = 0.5  # keypoints of the scene by those put aside; fewer show no common motion
_NEW_RATIO = 0.5  # keypoints of a motion by those on known objects; fewer do not show new objects


class DynamicObjectCheck:
    """
    Checks registrations for objects that move by themselves.

    :param settings: the sensor, and the acceleration noise of the motion model.
    :param agreement: of the keypoints of the camera with its depth.
    :param acceleration: that frames have shown.
    """

    def __init__(self, refinement: Refinement, settings: Settings,
                 agreement: SensorAgreement, acceleration: ApparentAcceleration) -> None:
        self._refinement = refinement
        self._agreement = agreement
        self._acceleration = acceleration
        self._sensor = settings.sensor
        self._sudden = sudden_accelerations(settings.odometry)
        self._prior = MotionPrior(settings.odometry)

    def check(self, found: Registration, source: PreparedFrame, target: PreparedFrame,
              expected: ExpectedPose) -> Registration:
        """
        Return the registration, or the one without its keypoints if the images support that more.

        Where the images do not decide, the difference of the two poses adds to the covariance. It
        fails where the pose is that of what has moved before, and nothing shows another one.
        """
        if (source.surface is None or target.surface is None
                or source.grey.shape != target.grey.shape):
            return found
        is_contradicted = self._agreement.is_lost_by(found, target)
        if is_contradicted:
            found = self._without_small_objects(found, source, target)
            is_contradicted = self._agreement.is_lost_by(found, target)
        beside = self._beside_known_objects(found, source, target, expected)
        if beside is not None:
            return beside
        sudden = suddenness(found.T_target_source, expected, self._sudden)
        if sudden <= 1.0 and not is_contradicted and not _has_moving(found.fit):
            return found
        rest = self._without_keypoints_of(found, source, target, expected)
        if (is_contradicted and differ(found.pose, rest.pose)
                and not _has_moved_before(rest.fit, found.fit)
                and self._may_replace(rest, found, expected)
                and self._agreement.is_better_by(rest, found)):
            near = self._of_all_near(rest, found, source, target)
            return _of_the_rest(found, near, f'{found.support} keypoints move by themselves, '
                                f'depth agrees with {len(near.tracked)} others')
        compared = self._compared(found, rest, source, target, expected)
        if compared.T_target_source is found.T_target_source and self._is_alone(found, expected):
            return failed(Status.TOO_FEW_MATCHES, f'{found.support} keypoints are on what has '
                          'moved before, nothing else shows the motion')
        fit = found.fit
        if (compared is found and fit is not None and fit.has_objects
                and self._is_one_motion(found, rest, expected)):
            return dataclasses.replace(found, fit=dataclasses.replace(fit, objects=None))
        return compared

    def _beside_known_objects(self, found: Registration, source: PreparedFrame,
                              target: PreparedFrame,
                              expected: ExpectedPose) -> Registration | None:
        """
        Return the registration by what has not moved before, if only that moves as expected.

        Where too little else is in the view, what has moved before may be the scene itself: it is,
        if only one motion of it is as expected.
        """
        if not self._prior.is_exceeded_by(found.pose, expected):
            return None
        scene = self._refinement.without_known_objects(source, target, expected.T_target_source)
        if scene is None or not self._continues(scene, found, expected):
            return None
        where = ('beside what has moved before' if scene.fit is None or not scene.fit.known_share
                 else '(few of them beside what has moved before)')
        result = _of_the_rest(
            found, scene, f'{len(scene.tracked)} keypoints {where} continue the motion')
        return None if self._agreement.is_lost_by(result, target) else result

    def _continues(self, rest: Refined, found: Registration, expected: ExpectedPose) -> bool:
        """Return whether keypoints confirm a pose that moves as expected, unlike the one found."""
        return rest.is_confirmed and self._prior.is_continued_by(rest.pose, found.pose, expected)

    def _may_replace(self, rest: Refined, found: Registration, expected: ExpectedPose) -> bool:
        """Return whether the rest are not few, or the pose found does not move as expected."""
        return (len(rest.tracked) > _FEW_LEFT * found.support
                or self._prior.is_exceeded_by(found.pose, expected))

    def _is_alone(self, found: Registration, expected: ExpectedPose) -> bool:
        """Return whether a pose is that of what has moved before, and moves still or may."""
        return _is_known(found.fit) and (
            expected.elapsed > _LONGEST_ALONE or self._prior.is_exceeded_by(found.pose, expected))

    def _is_one_motion(self, found: Registration, rest: Refined, expected: ExpectedPose) -> bool:
        """
        Return whether what seems to be on objects moves with the scene, as far as is known.

        What moves along a wall differs from the motion expected at least, and what has moved
        before may move slowly now. More than half as many of the remaining keypoints as were put
        aside must agree with the motion of the scene.
        """
        objects = None if found.fit is None else found.fit.objects
        aside = 0 if objects is None else objects.count
        return (rest.is_confirmed and not _is_known(rest.fit)
                and len(rest.tracked) > _SCENE_RATIO * aside
                and not differ(found.pose, rest.pose)
                and not self._prior.is_exceeded_by(rest.pose, expected))

    def _compared(self, found: Registration, rest: Refined, source: PreparedFrame,
                  target: PreparedFrame, expected: ExpectedPose) -> Registration:
        """Return the registration, or the pose of the rest where all evidence is for that."""
        motions = None if not rest.is_confirmed else TwoMotions.of(
            found, rest.applied_to(found, ''), expected.T_target_source,
            self._acceleration.sigmas(source.stamp, expected))
        if motions is not None and motions.are_confirmed:
            if motions.evidence > 0.0 and differ(found.pose, rest.pose):
                near = self._of_all_near(rest, found, source, target)
                return _of_the_rest(found, near, f'{found.support} keypoints move by themselves, '
                                    f'{len(near.tracked)} others with the scene')
            if motions.weaker_share > _CERTAIN_SHARE:
                return found
        second = fused(self._prior.of(expected), rest.pose)
        if _is_known(found.fit) and (_is_of_scene(rest.fit)
                                     or self._continues(rest, found, expected)):
            # what moves along a wall is known by the motion expected alone
            return _at(second, found, rest,
                       f'{found.support} keypoints are on what has moved before',
                       are_moving=differ(found.pose, second))
        if _has_moved_before(rest.fit, found.fit):
            return found
        sudden = suddenness(found.T_target_source, expected, self._sudden)
        return found if sudden <= 1.0 else self._by_vote(
            found, rest, source, target, second, sudden)

    def _without_small_objects(self, found: Registration, source: PreparedFrame,
                               target: PreparedFrame) -> Registration:
        """Return a registration that depth contradicts, without the few keypoints it is due to."""
        without = self._refinement.without_small_objects(source, target, found.T_target_source)
        if (without.fit is None or not without.fit.has_objects
                or len(without.tracked) < _LEFT_SHARE * found.support
                or not self._agreement.is_better_by(without, found)):
            return found
        return without.applied_to(found, found.reason)

    def _of_all_near(self, rest: Refined, found: Registration, source: PreparedFrame,
                     target: PreparedFrame) -> Refined:
        """Return the pose of the rest by all keypoints that agree with it, if it is the same."""
        near = self._refinement.refine_near(source, target, rest.T_target_source)
        is_of_the_rest = (is_same(near.T_target_source, rest.T_target_source)
                          and self._agreement.is_better_by(near, found))
        return near if is_of_the_rest else rest

    def _by_vote(self, found: Registration, rest: Refined, source: PreparedFrame,
                 target: PreparedFrame, second: PoseWithCovariance,
                 sudden: float) -> Registration:
        """Return the registration, or the pose of the rest with a prior, as the images vote."""
        if is_same(found.T_target_source, second.matrix):
            return found
        vote = pose_vote(source, target, found.T_target_source, second.matrix, self._sensor)
        if not _is_for_second(vote, sudden):
            return _with_alternative(found, second.matrix, vote)
        reason = (f'{found.support} keypoints move by themselves, {vote.second:.0%} of the view '
                  'shows another motion')
        return _at(second, found, rest, reason, are_moving=differ(found.pose, rest.pose))

    def _without_keypoints_of(self, found: Registration, source: PreparedFrame,
                              target: PreparedFrame, expected: ExpectedPose) -> Refined:
        """Return the pose from all keypoints but those that support a registration."""
        first, is_free = expected.T_target_source, np.ones(len(source.keypoints), bool)
        if found.tracks is not None:
            is_free[found.tracks.keypoints] = False
        rest = np.flatnonzero(is_free)
        refined = self._refinement.refine(
            dataclasses.replace(source, keypoints=source.keypoints[rest]), target, first, None,
            self._refinement.first_tracks.of_some(source, target, first, rest), found.tracks)
        if len(refined.tracked) < FEWEST_TO_CONFIRM or (
                _is_known(found.fit) and _is_known(refined.fit)
                and not self._continues(refined, found, expected)):  # use the depth images alone
            refined = dataclasses.replace(self._refinement.refine(
                dataclasses.replace(source, keypoints=source.keypoints[:0]), target, first,
                None, None, found.tracks), bias=None)
        tracks = refined.tracked
        return dataclasses.replace(
            refined, tracked=dataclasses.replace(tracks, keypoints=rest[tracks.keypoints]))


def _of_the_rest(found: Registration, rest: Refined, reason: str) -> Registration:
    """Return a registration with the pose by other keypoints, from which nothing is learned."""
    return dataclasses.replace(rest.applied_to(found, reason), matches=found.matches[:0],
                               measure=None)


def _at(pose: PoseWithCovariance, found: Registration, rest: Refined, reason: str,
        are_moving: bool) -> Registration:
    """
    Return a registration at the pose of the rest with a prior, by few keypoints or none.

    :param are_moving: whether it shows that the keypoints of the first one are on objects that
        move. If not, the objects of ``found`` are kept, as they are where ``found`` is supported
        by less than half as many keypoints as are on them.
    """
    fit, known = rest.fit, None if found.fit is None else found.fit.objects
    if fit is not None and (not are_moving or known is not None
                            and found.support < _NEW_RATIO * known.count):
        fit = dataclasses.replace(fit, objects=known)
    return dataclasses.replace(
        _of_the_rest(found, rest, reason), T_target_source=pose.matrix, fit=fit,
        covariance=pose.covariance, systematic=np.zeros((6, 6)), evidence=Evidence.DEPTH)


def _has_moving(fit: Fit | None) -> bool:
    """Return whether images show objects that move, or a pose is that of what has moved before."""
    return fit is not None and fit.has_objects or _is_known(fit)


def _is_known(fit: Fit | None) -> bool:
    """Return whether a pose is that of what has moved before."""
    return fit is not None and fit.is_of_known_objects


def _has_moved_before(fit: Fit | None, other: Fit | None) -> bool:
    """Return whether a pose is that of what has moved before, and another one is not."""
    return _is_known(fit) and not _is_known(other)


def _is_of_scene(fit: Fit | None) -> bool:
    """Return whether a pose is by what has not moved before."""
    return (fit is not None and fit.known_share < _FEW_KNOWN
            and fit.scene_share > _LEAST_OF_SCENE)


def _is_for_second(vote: PoseVote, sudden: float) -> bool:
    needed = max(_MINORITY, _MAJORITY * np.exp(0.5 * (1.0 - sudden)))
    return (vote.seen > _LEAST_SEEN and vote.second > _LEAST_FOR_SECOND
            and vote.for_second > needed)


def _with_alternative(found: Registration, second: np.ndarray, vote: PoseVote) -> Registration:
    """Return a registration that may be wrong, with the variance of a choice between two poses."""
    difference = se3.difference(found.T_target_source, second)
    return dataclasses.replace(found, covariance=(
        found.covariance + vote.for_second * np.outer(difference, difference)))
