# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The rule for how long a keyframe serves as the reference."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.result import Registration
from aick_ros.settings import Settings

_MIN_SHAPE_OVERLAP = 0.8
"""Share of a depth image that the one it is registered to must show, to serve for the next.

Chosen on an excerpt of a real recording and six rendered rooms: with 0.6 the error grows up to
three times as fast where views have little shape, with 0.85 as fast."""

_MIN_OF_FIRST_OVERLAP = 0.95
"""The same, as a ratio to the share that the first frame registered to it has in common with it.

Chosen on two excerpts of real recordings and on rendered rooms with three kinds of cameras: how
much of two views alike lies on each other's planes depends on the camera, from 0.7 to 0.95."""

_LARGEST_GROWTH = 2.0
"""Largest variance of a frame by noise, by that of the first one registered to the keyframe.

Derived: where it grows with the square of the motion, keyframes that follow each other at this
ratio add up the least variance along a path."""

_LARGEST_TRACKED_GROWTH = 3.0
"""The same where keypoints are tracked from the keyframe.

Chosen on two excerpts of real recordings and 35 rendered ones: the drift is a seventh less than
by the rule of a chain. With 4 it is the same on those, but larger on one of the excerpts."""


class KeyframePolicy:
    """
    Decides how long a frame serves as the keyframe.

    Registrations to one keyframe do not accumulate its error, but the farther the camera moves,
    the less of the keyframe is visible, and the worse they get. A keyframe is kept while enough
    of it is matched, and while the variance of a registration to it by noise is at most a multiple
    of that of the first one: another keyframe would not lessen biases. Frames with keypoints of
    their own keep it, too, while their variance is at most that of a chain: the variance of the
    frame before plus that of one step.

    Where objects have moved into the view, another keyframe would have no more of the scene, but
    keypoints on the objects: the more of the view they cover, the less of the rest must match.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings.odometry
        self._tracks = settings.odometry.aick_interval > 1
        self._largest_growth = _LARGEST_TRACKED_GROWTH if self._tracks else _LARGEST_GROWTH
        self._refinement = settings.refinement
        self.begin()

    def begin(self) -> None:
        """Start with another keyframe."""
        self._variances: tuple[float, float, float] | None = None
        self._first_overlap: tuple[int, float] | None = None  # with the stamp of its image

    def keeps(self, prepared: PreparedFrame, registration: Registration, count: int,
              lost: int = 0) -> bool:
        """
        Return whether the keyframe that a frame was registered to serves for the next one.

        :param count: number of keypoints of which some support the registration.
        :param lost: of these, to objects that move or have moved in.
        """
        return self._variances_with(prepared, registration, count, lost) is not None

    def advance(self, prepared: PreparedFrame, registration: Registration, count: int,
                lost: int = 0) -> bool:
        """Return what :meth:`keeps` does, and advance to the frame, if it does."""
        variances = self._variances_with(prepared, registration, count, lost)
        self._variances = variances or self._variances
        return variances is not None

    def _variances_with(self, prepared: PreparedFrame, registration: Registration,
                        count: int, lost: int) -> tuple[float, float, float] | None:
        """
        Return variances of the registrations to a keyframe; None: it has served.

        They are that of the first one by noise, that of the frame, and that of one step.
        """
        share = max(1.0 - lost / max(count, 1), 0.0)  # that is left of the scene
        least = max(self._settings.min_overlap * share ** 2 * self._refinement.sought(count), 1.0)
        if self._settings.reference == 'previous' or registration.support < least:
            return None
        noise = scene_variance(prepared, registration.unbiased_pose.covariance)
        variance = scene_variance(prepared, registration.image_pose.covariance)
        first, last, step = self._variances or (noise, variance, variance)
        # fewer keypoints have more noise: a new keyframe would have it too
        is_kept = share * noise <= self._largest_growth * first or (
            not self._tracks and variance <= last + step)
        return (first, variance, step) if is_kept else None

    def keeps_depth_reference(self, stamp: int, registration: Registration) -> bool:
        """
        Return whether the depth image that a frame was registered to serves for the next.

        :param stamp: of that image [ns].
        """
        if self._first_overlap is None or stamp != self._first_overlap[0]:
            self._first_overlap = stamp, registration.overlap
        return registration.overlap >= max(
            _MIN_SHAPE_OVERLAP, _MIN_OF_FIRST_OVERLAP * self._first_overlap[1])


def scene_variance(prepared: PreparedFrame, covariance: np.ndarray) -> float:
    """
    Return the variance of the position of the scene due to the error of a pose [m^2].

    It is that of a point on the optical axis at the median depth of the keypoints, with rotation
    about all three axes counted, summed over the axes.

    :param covariance: 6x6 of the pose.
    """
    x, y, z, *turns = covariance.diagonal().tolist()
    return float(x + y + z + prepared.scene_depth ** 2 * sum(turns))
