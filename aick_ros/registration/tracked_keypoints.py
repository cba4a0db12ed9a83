# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Registration by the keypoints of the target, tracked into the source; no detector is needed.

The source has no keypoints of its own: those of the target are sought where the expected motion
puts them. So nothing but the motion model says that the place is the right one. Where too few are
found, or where they contradict the expected motion, the registration fails, and AICK decides, or
keypoints of the source itself where AICK finds no pose.

A source whose depth is missing is registered in the same way: the depth of the target places the
keypoints, as in a perspective n-point problem.
"""

from __future__ import annotations

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.refinement.refined import CONTRADICTION, Refined
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.registration.unexpected_motion import is_continued, sudden_accelerations
from aick_ros.settings import Settings

SHARE_TRACKED = 0.46
"""Share of the keypoints that must be tracked.

Chosen: where fewer are, keypoints of the frame itself make its pose more accurate; on an excerpt
of a real recording that turns fast, by a tenth of the drift with 0.45 instead of 0.35; but such
frames take twice the time."""

_SHARE_FOLLOWED = 0.25
"""The same by colour alone, where the frame before was not lost: nothing else finds its pose.

Chosen on two excerpts of real recordings without depth for half a second, from 28 frames on: 131
instead of 212 frames are lost. With 0.12 poses are up to 11 cm off where depth never comes back,
and after a loss one is 3 deg off with 0.25."""


class TrackedKeypoints:
    """Registers frames of one camera by the keypoints of earlier ones."""

    def __init__(self, settings: Settings, refinement: Refinement) -> None:
        self._refinement = refinement
        self._settings = settings.refinement
        self._sudden = sudden_accelerations(settings.odometry)

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: ExpectedPose) -> tuple[PreparedFrame, Registration]:
        """
        Return the source with the keypoints found in it, and its pose in the target.

        :param source: its keypoints are not used; its twist is that of the frame before.
        """
        if source.grey.shape != target.grey.shape:
            return source, failed(Status.TOO_FEW_MATCHES, 'the images differ in size')
        refined = self._refinement.refine_back(source, target, expected.T_target_source,
                                               expected.prediction(source.twist))
        tracks, sought = refined.tracked, self._settings.sought(len(target.keypoints))
        reason = f'{len(tracks)} keypoints tracked from the keyframe'
        if len(tracks) < FEWEST_TO_CONFIRM:
            return source, failed(Status.TOO_FEW_MATCHES, f'{reason}, of {sought}')
        if refined.is_contradicted:
            return source, failed(Status.TOO_FEW_MATCHES, CONTRADICTION)
        doubt = self._doubt(refined, expected)
        if doubt:
            return source, _rough(refined, f'{reason} {doubt}')
        if len(tracks) < SHARE_TRACKED * sought:
            return source, _rough(refined, f'{reason}, of {sought}')
        source = replaced(source, is_tracked=True, keypoints=_keypoints(
            tracks, source, target.keypoints))
        self._refinement.remember_objects(
            source, target, refined.T_target_source, refined.tracked, refined.fit)
        return source, _registration(refined, reason)

    def register_without_depth(self, source: PreparedFrame, target: PreparedFrame,
                               expected: ExpectedPose, is_followed: bool = False) -> Registration:
        """
        Return the pose in the target of a source that needs no depth.

        AICK cannot confirm it, so that too few keypoints are no pose. Other parameters are as for
        :meth:`register`.

        :param is_followed: whether the frame before was not lost, so that fewer suffice.
        """
        if source.grey.shape != target.grey.shape:
            return failed(Status.TOO_FEW_MATCHES, 'the images differ in size')
        refined = self._refinement.refine_without_depth(source, target, expected.T_target_source)
        count, sought = len(refined.tracked), self._settings.sought(len(target.keypoints))
        reason = f'by colour alone, {count} keypoints tracked from the keyframe'
        share = _SHARE_FOLLOWED if is_followed else SHARE_TRACKED
        if count < max(FEWEST_TO_CONFIRM, share * sought):
            return failed(Status.TOO_FEW_MATCHES, f'{reason}, of {sought}')
        if refined.is_contradicted:
            return failed(Status.TOO_FEW_MATCHES, CONTRADICTION)
        doubt = self._doubt(refined, expected)
        if doubt:
            return failed(Status.TOO_FEW_MATCHES, f'{reason} {doubt}')
        return Registration(
            Status.OK, reason, refined.T_target_source, refined.covariance,
            np.empty((0, 2), np.intp), 0, support=count, evidence=Evidence.COLOUR_ALONE,
            systematic=refined.systematic, by_readout=refined.by_readout)

    def _doubt(self, refined: Refined, expected: ExpectedPose) -> str:
        """Return why keypoints may not show the motion of the camera; '' if they do."""
        if not is_continued(refined.T_target_source, expected, self._sudden):
            return 'show a sudden motion'
        if refined.fit is not None and refined.fit.is_of_known_objects:
            return 'are on what has moved before'
        return ''


def _rough(refined: Refined, reason: str) -> Registration:
    """Return a pose that AICK, or keypoints of the source itself, have to confirm."""
    return replaced(failed(Status.TOO_FEW_MATCHES, reason),
                    T_target_source=refined.T_target_source, is_rough=True)


def _registration(refined: Refined, reason: str) -> Registration:
    rows = np.arange(len(refined.tracked))
    return Registration(
        Status.OK, reason, refined.T_target_source, refined.covariance,
        np.array((rows, refined.tracked.keypoints)).T, 0, support=len(rows),
        bias=refined.bias, tracks=replaced(refined.tracked, keypoints=rows),
        systematic=refined.systematic, measure=refined.measure, fit=refined.fit,
        by_readout=refined.by_readout)


def _keypoints(tracks: Tracks, source: PreparedFrame, known: KeypointFrame) -> KeypointFrame:
    """Return tracked keypoints as the source sees them, with the descriptors they are known by."""
    return replaced(
        known, stamp=source.stamp, positions=tracks.points.astype(np.float32),
        descriptors=known.descriptors.take(tracks.keypoints, axis=0),
        covariances=known.covariances.take(tracks.keypoints, axis=0),
        pixels=source.frame.camera.project(tracks.points).astype(np.float32), words=None)
