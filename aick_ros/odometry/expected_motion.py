# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The motion that is expected of the camera, with its covariance, whoever expects it.

It is that of the motion model, or of another odometry, with a term for each sensor that measures
a part of it. Registrations begin there, frames without images continue there, and what the images
show is joined with the same terms.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.motion_term import LARGEST_DISAGREEMENT, MotionTerm
from aick_ros.registration.result import Registration
from aick_ros.settings import OdometrySettings


class ExpectedMotion:
    """
    Expects motions between stamps.

    :param settings: of the motion model.
    :param gyroscope: with the samples of an IMU, if there are any.
    """

    def __init__(self, settings: OdometrySettings, gyroscope: Gyroscope) -> None:
        self._motion_model = MotionModel(settings)
        self._gyroscope = gyroscope

    def is_known(self, start: int, end: int, twist: np.ndarray | None) -> bool:
        """
        Return whether more is known of the motion between two stamps [ns] than its limits.

        :param twist: body velocity of the camera at the start; None: unknown.
        """
        holds = twist is not None and self._motion_model.holds(seconds(start, end))
        return holds or self._gyroscope.term(start, end) is not None

    def between(self, start: int, end: int, twist: np.ndarray | None,
                by_other: np.ndarray | None = None) -> PoseWithCovariance:
        """
        Return the motion ``T_camera0_camera1`` between two stamps [ns].

        :param twist: body velocity of the camera at the start; None: unknown.
        :param by_other: the motion by another odometry, 4x4; None: there is none.
        """
        motion = (self._motion_model.predict(twist, seconds(start, end)) if by_other is None
                  else self._motion_model.with_slip(by_other))
        term = self._gyroscope.term(start, end)
        return motion if term is None else term.added_to(motion)

    def twist_at(self, stamp: int, twist: np.ndarray) -> np.ndarray:
        """Return a body velocity with the turn rate at a stamp [ns], where that is measured."""
        rate = self._gyroscope.rate_at(stamp)
        return twist if rate is None else np.concatenate([twist[:3], rate])

    def joined(self, seen: Registration, start: int, end: int) -> Registration:
        """Return the registration of a frame to a keyframe, by their stamps [ns], with terms."""
        if not seen.status.ok or seen.is_by_depth:
            return seen  # the latter was registered with the expected motion as a term
        term = self._accepted(seen.pose, start, end, is_summed=True)
        if term is None:
            return seen
        joined, kept = term.added_to(seen.pose), term.kept(seen.pose)
        return dataclasses.replace(
            seen, T_target_source=joined.matrix, covariance=joined.covariance,
            systematic=kept @ seen.systematic @ kept.T, timing=kept @ seen.timing @ kept.T)

    def joined_increment(self, seen: Increment, start: int, end: int) -> Increment:
        """Return an increment between two stamps [ns], as the camera saw it, with the terms."""
        term = self._accepted(seen.pose, start, end)
        return seen if term is None else Increment(term.added_to(seen.pose), seen.interval)

    def _accepted(self, seen: PoseWithCovariance, start: int, end: int,
                  is_summed: bool = False) -> MotionTerm | None:
        term = self._gyroscope.term(start, end, is_summed) if end > start else None
        if term is None or term.disagreement(seen) > LARGEST_DISAGREEMENT:
            return None
        return term
