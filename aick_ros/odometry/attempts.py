# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Registrations of a frame to one reference after the other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.reference import Reference, References
from aick_ros.odometry.velocity import Velocity
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.problem import depth_rate
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Evidence, Registration
from aick_ros.registration.status import Status
from aick_ros.registration.systematic_error import stamp_sigma
from aick_ros.registration.unexpected_motion import NEAR_POSE
from aick_ros.settings import Settings

_SHARE_RECOGNISED = 0.12
"""Share of the keypoints that must be tracked where nothing is known of the motion.

Chosen on eight rendered rooms: of pairs of views of two rooms, which have furniture alike, 0.3 %
are registered instead of 4.5 %, of those that overlap 97 % as before."""

_SHARE_WITH_DEPTH = 0.5
"""Keypoints of a frame, by those sought of its keyframe, below which its depth is missing. Chosen:
keypoints have depth, so that a frame has few where it has little."""

_STAMPS = math.sqrt(6.0)
"""Errors of stamps in a motion that is expected, by that of one. Derived, at a constant rate: the
velocity has those of two stamps, and of both intervals the middle one counts twice."""

KnownViews = Callable[[Reference, np.ndarray], Sequence[KnownView]]
"""Returns the views beside a reference, by it and the pose expected of a frame in it, 4x4."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """
    A frame registered to a reference.

    :param seen: the registration by the images alone.
    :param registration: the same, with what other sensors say.
    :param status: OK, or why the registration failed or was rejected.
    :param increment: motion from the reference to the frame; meaningless if registration failed.
    """

    reference: Reference
    seen: Registration
    registration: Registration
    increment: Increment
    status: Status
    reason: str


class Attempts:
    """Registers frames to references, and checks the results."""

    def __init__(self, settings: Settings, registrar: Registrar,
                 expected: ExpectedMotion) -> None:
        self._min_matches = settings.odometry.min_matches
        self._refinement = settings.refinement
        self._motion_model = MotionModel(settings.odometry)
        self._registrar = registrar
        self._expected = expected

    def of(self, prepared: PreparedFrame, references: References, velocity: Velocity,
           views: KnownViews, tracked: np.ndarray | None = None) -> Iterator[Attempt]:
        """
        Yield registrations of a frame, until one is accepted.

        They are by keypoints, then by colour alone where depth is missing, then by depth alone.
        Depth comes before poses that no track confirms, as of a sharp image in a blurred one.

        :param views: what is known beside a reference, where the frame is expected in it.
        :param tracked: rough pose in the keyframe by tracking, 4x4; None: there is none.
        """
        prepared, motion = self._moving(prepared, references.last, velocity)
        doubtful = []
        if prepared.repeat is not Repeat.COLOUR:
            expected = self._expected_pose(prepared, references.last.stamp, motion, velocity)
            for attempt in self._by_keypoints(prepared, references, expected, tracked):
                if _is_doubtful(attempt, prepared):
                    doubtful.append(attempt)
                else:
                    yield attempt
            yield from self._by_colour(prepared, references, expected or self._from_rest(
                prepared, references.last.stamp, velocity))
        last = references.last.stamp
        if motion is None and self._is_near_by_depth(prepared, seconds(last, prepared.stamp)):
            motion = self._expected.between(last, prepared.stamp, None)
        if motion is not None:
            yield from self._by_depth(prepared, references, motion, velocity, views)
        lost = references.lost_in_the_dark
        if lost is not None and self._is_near_by_depth(
                prepared, seconds(lost.stamp, prepared.stamp)):
            motion = self._expected.between(lost.stamp, prepared.stamp, None)
            yield self._by_depth_of(lost, prepared, motion, motion.covariance, (), is_moving=True)
        yield from doubtful

    def by_tracking(self, prepared: PreparedFrame, references: References,
                    velocity: Velocity
                    ) -> tuple[PreparedFrame, Attempt | None]:
        """
        Return a frame with keypoints tracked from the keyframe, registered to that.

        Without an expected motion there is no attempt; parameters as for :meth:`of`.
        """
        keyframe, last = references.keyframe, references.last
        moving, motion = self._moving(prepared, last, velocity)
        expected = self._expected_pose(prepared, last.stamp, motion, velocity)
        if expected is None:
            return prepared, None
        tracked, registration = self._registrar.track(
            moving, keyframe.prepared, expected.seen_from(_from(keyframe, last)))
        return tracked, self._checked(tracked, keyframe, registration)

    def _moving(self, prepared: PreparedFrame, last: Reference, velocity: Velocity
                ) -> tuple[PreparedFrame, PoseWithCovariance | None]:
        """Return a frame with the velocity expected, and the motion since the last frame."""
        twist = velocity.twist
        if not self._expected.is_known(last.stamp, prepared.stamp, twist):
            return prepared, None
        if twist is not None:
            prepared = prepared.moving(self._expected.twist_at(prepared.stamp, twist),
                                       velocity.variances_after(
                                           seconds(last.stamp, prepared.stamp)))
        return prepared, self._expected.between(last.stamp, prepared.stamp, twist)

    def _expected_pose(self, prepared: PreparedFrame, last: int, motion: PoseWithCovariance | None,
                       velocity: Velocity) -> ExpectedPose | None:
        """Return the pose of a frame that is expected in the last one, of a stamp [ns]."""
        if motion is None:
            return None
        steady = self._expected.steady(last, prepared.stamp, velocity.twist)
        return ExpectedPose(motion.matrix, seconds(velocity.confirmed, prepared.stamp),
                            None if steady is None else steady.matrix,
                            _timing(velocity.twist, prepared.stamp_jitter or 0.0))

    def _from_rest(self, prepared: PreparedFrame, last: int,
                   velocity: Velocity) -> ExpectedPose | None:
        """
        Return the pose of a frame soon after a first one, of a stamp [ns], if the camera rests.

        None: its velocity is known, or was. What is tracked has to agree with rest to 5 cm and
        3 deg, and with the acceleration of a camera that begins to move.
        """
        elapsed = seconds(last, prepared.stamp)
        if velocity.twist is not None or not self._motion_model.holds(elapsed):
            return None
        return ExpectedPose(np.eye(4), elapsed)

    def _by_keypoints(self, prepared: PreparedFrame, references: References,
                      expected: ExpectedPose | None, tracked: np.ndarray | None
                      ) -> Iterator[Attempt]:
        for reference in references.candidates(prepared):
            attempt = self._checked(prepared, reference, self._registrar.register(
                prepared, reference.prepared,
                expected and expected.seen_from(_from(reference, references.last)),
                tracked if reference is references.keyframe else None))
            yield attempt if expected is not None else self._recognised(attempt, prepared)

    def _by_colour(self, prepared: PreparedFrame, references: References,
                   expected: ExpectedPose | None) -> Iterator[Attempt]:
        """Yield the registration of a frame without enough depth to the keyframe, if any."""
        keyframe = references.keyframe
        sought = self._refinement.sought(len(keyframe.prepared.keypoints))
        if expected is not None and len(prepared.keypoints) < _SHARE_WITH_DEPTH * sought:
            yield self._checked(prepared, keyframe, self._registrar.register_colour(
                prepared, keyframe.prepared,
                expected.seen_from(_from(keyframe, references.last)), not references.is_lost))

    def _is_near_by_depth(self, prepared: PreparedFrame, elapsed: float) -> bool:
        """
        Return whether a frame may be registered by depth alone where no motion is known.

        Without keypoints it is for longer: until the camera may have turned in any direction, and
        as long as images repeat that show rest.
        """
        if prepared.repeat is Repeat.BOTH:
            return True
        if len(prepared.keypoints) < self._min_matches:
            return not self._motion_model.is_unlimited(elapsed)
        return self._motion_model.holds(elapsed)

    def _by_depth(self, prepared: PreparedFrame, references: References,
                  motion: PoseWithCovariance, velocity: Velocity,
                  views: KnownViews) -> Iterator[Attempt]:
        twist = np.zeros(6) if velocity.twist is None else velocity.twist
        blind = PoseWithCovariance(motion.matrix, self._expected.between(
            velocity.confirmed, prepared.stamp,
            twist if velocity.is_confirmed else None).covariance)
        for reference in references.depth_references():
            T_reference_last = _from(reference, references.last)
            expected = T_reference_last @ motion
            yield self._by_depth_of(
                reference, prepared, expected, (T_reference_last @ blind).covariance,
                views(reference, expected.matrix), is_moving=velocity.twist is None)

    def _by_depth_of(self, reference: Reference, prepared: PreparedFrame,
                     expected: PoseWithCovariance, unobserved: np.ndarray,
                     views: Sequence[KnownView], is_moving: bool) -> Attempt:
        """
        Return the registration of a frame to the depth of a reference.

        :param unobserved: 6x6, the covariance of what no surface shows.
        :param is_moving: at a velocity that is not known: it is registered once more with the one
            found, as the camera has moved between the times of colour and of depth.
        """
        beside = reference.prepared, expected, unobserved, views
        found = self._registrar.register_depth(prepared, *beside)
        if is_moving and found.status.ok:
            found = self._registrar.register_depth(
                prepared.moving(_twist_by_depth(prepared, reference, found)), *beside)
        return self._checked(prepared, reference, found)

    def _checked(self, prepared: PreparedFrame, reference: Reference,
                 seen: Registration) -> Attempt:
        fused = self._expected.fused(seen, reference.stamp, prepared.stamp)
        if reference.loss is not None and reference.loss.twist is not None:
            fused = self._expected.with_alternative(
                fused, reference.stamp, prepared.stamp, reference.loss.twist)
        increment = Increment(fused.pose, seconds(reference.stamp, prepared.stamp))
        return Attempt(reference, seen, fused, increment, *self._check(fused, increment))

    def _recognised(self, attempt: Attempt, prepared: PreparedFrame) -> Attempt:
        """
        Return an attempt without an expected motion; failed if it may well be of another place.

        A few keypoints of another place are always somewhat alike: a pose that is not certain may
        be of any. After so long that the camera may have turned in any direction, limits of the
        motion exclude nothing, so that many have to be alike.
        """
        interval, count = attempt.increment.interval, attempt.registration.support
        if attempt.status.ok and not _is_certain(attempt.registration.covariance):
            return replace(attempt, status=Status.TOO_FEW_MATCHES, reason=(
                f'{attempt.reason}, too uncertain to recognise the place'))
        sought = self._refinement.sought(len(prepared.keypoints))
        if (not attempt.status.ok or attempt.registration.tracks is None
                or not self._motion_model.is_unlimited(interval)
                or count >= _SHARE_RECOGNISED * sought):
            return attempt
        return replace(attempt, status=Status.TOO_FEW_MATCHES, reason=(
            f'{count} of {sought} keypoints tracked, too few to recognise the place after '
            f'{interval:.1f} s'))

    def _check(self, registration: Registration, increment: Increment) -> tuple[Status, str]:
        """Return OK, or why a registration is rejected."""
        if not registration.status.ok:
            return registration.status, registration.reason
        count = registration.support
        if registration.evidence is Evidence.KEYPOINTS and count < self._min_matches:
            return Status.TOO_FEW_MATCHES, (
                f'{count} matches, odometry.min_matches is {self._min_matches}')
        violation = self._motion_model.violation(increment)
        if violation:
            return Status.MOTION_GATE, violation
        return Status.OK, registration.reason


def _timing(twist: np.ndarray | None, jitter: float) -> tuple[float, float]:
    """Return how far a pose is off the one expected by errors of stamps [m, rad]."""
    if twist is None:
        return 0.0, 0.0
    error = _STAMPS * stamp_sigma(jitter)
    return error * math.hypot(*twist[:3]), error * math.hypot(*twist[3:])


def _is_certain(covariance: np.ndarray) -> bool:
    """Return whether a pose is as certain as two have to be that are taken for one."""
    along, about = (float(np.linalg.eigvalsh(part)[-1])
                    for part in (covariance[:3, :3], covariance[3:, 3:]))
    return along <= NEAR_POSE[0] ** 2 and about <= NEAR_POSE[1] ** 2


def _is_doubtful(attempt: Attempt, prepared: PreparedFrame) -> bool:
    """Return whether no track confirms a pose, though depth may know better."""
    return (attempt.status.ok and attempt.registration.tracks is None
            and prepared.surface is not None
            and prepared.grey.shape == attempt.reference.prepared.grey.shape)


def _twist_by_depth(prepared: PreparedFrame, reference: Reference,
                    found: Registration) -> np.ndarray:
    """Return the body velocity between two depth images, 6 [m/s, rad/s]."""
    interval = (seconds(reference.stamp, prepared.stamp)
                * depth_rate(prepared, reference.prepared))
    twist: np.ndarray = se3.log(found.T_target_source) / interval
    return twist


def _from(reference: Reference, last: Reference) -> np.ndarray:
    """Return ``T_reference_last``, 4x4."""
    T_reference_last: np.ndarray = se3.inverse(reference.pose.matrix) @ last.pose.matrix
    return T_reference_last
