# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the next keyframe: the one before, or the frame just tracked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.odometry.attempts import Attempt
from aick_ros.odometry.keyframe import KeyframePolicy
from aick_ros.odometry.reference import Reference, References
from aick_ros.registration.refinement.intruders import hidden_by_intruders, on_intruders
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.settings import Settings

Rule = Callable[[PreparedFrame, Registration, int, int], bool]
"""Returns whether a keyframe serves on, by a frame and its registration; see the policy."""


class KeyframeChoice:
    """Advances the references to tracked frames, and makes keyframes of some of these."""

    def __init__(self, settings: Settings, registrar: Registrar) -> None:
        self._policy, self._sensor = KeyframePolicy(settings), settings.sensor
        self._registrar = registrar

    def begin(self) -> None:
        """Start with another keyframe."""
        self._policy.begin()

    def replaces(self, prepared: PreparedFrame, attempt: Attempt) -> bool:
        """Return whether a frame that was registered to the keyframe will be the next one."""
        keyframe = self._registrar.prepared_like(attempt.reference.prepared, prepared)
        return not self._is_kept(prepared, keyframe, attempt.seen, self._policy.keeps)

    def advance(self, references: References, last: Reference, attempt: Attempt) -> None:
        """
        Advance to a tracked frame.

        :param last: the frame, with the pose that its images show.
        :param attempt: the registration by which it was tracked.
        """
        if attempt.registration.is_by_depth:
            self._by_depth(references, last, attempt)
        else:
            self._by_keypoints(references, last, attempt)

    def _by_depth(self, references: References, last: Reference, attempt: Attempt) -> None:
        references.confirm(attempt.reference)
        if self._policy.keeps_depth_reference(attempt.reference.stamp, attempt.seen):
            references.track_by_depth(last, attempt.reference)
        else:
            reference = Reference(last.prepared, last.pose)
            references.track_by_depth(reference, reference)

    def _by_keypoints(self, references: References, last: Reference, attempt: Attempt) -> None:
        prepared, reference = last.prepared, attempt.reference
        references.confirm(reference)
        if reference is not references.keyframe:
            self._policy.begin()
        kept = self._registrar.prepared_like(reference.prepared, prepared)
        if self._is_kept(prepared, kept, attempt.seen, self._policy.advance):
            if kept.twist_variances is None and prepared.twist is not None:  # as of a first frame
                twist = prepared.twist if kept.twist is None else kept.twist
                kept = kept.moving(twist, prepared.twist_variances)
            references.track(last, Reference(kept, reference.pose, loss=reference.loss))
        else:
            if prepared.is_tracked:
                prepared = self._registrar.with_own_keypoints(prepared)
            keyframe = Reference(prepared, last.pose)
            references.track(keyframe, keyframe.bare())
            self._policy.begin()

    def _is_kept(self, prepared: PreparedFrame, keyframe: PreparedFrame,
                 seen: Registration, rule: Rule) -> bool:
        """
        Return whether a keyframe serves on, by a rule for frames that could be the next one.

        What other sensors know of the motion is no reason for another keyframe: beside a rotation
        by a gyroscope, which is exact over the first frames, the noise of later ones is large.

        :param keyframe: prepared as the frame is.
        :param seen: the registration of the frame to it by the images alone.
        """
        if seen.is_by_colour:  # it has too little depth
            return True
        count = len((keyframe if prepared.is_tracked else prepared).keypoints)
        if (prepared.repeat is not Repeat.NONE or rule(prepared, seen, count, 0)
                or prepared.is_blurred_beside(keyframe)):
            return True
        lost = self._on_objects(prepared, keyframe, seen)
        return lost > 0 and rule(prepared, seen, count, lost)

    def _on_objects(self, prepared: PreparedFrame, keyframe: PreparedFrame,
                    registration: Registration) -> int:
        """Return how many keypoints are lost to objects that move, or have moved in."""
        lost_to = hidden_by_intruders if prepared.is_tracked else on_intruders
        lost = lost_to(prepared, keyframe, registration.T_target_source, self._sensor)
        fit = registration.fit
        moving = 0 if fit is None or fit.objects is None else fit.objects.count
        return max(int(np.count_nonzero(lost)), moving)
