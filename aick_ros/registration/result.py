# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Result of a registration."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import definite
from aick_ros.geometry.pose import PoseWithCovariance, unknown_covariance
from aick_ros.registration.found_objects import FoundObjects
from aick_ros.registration.samples import Measure
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import Tracks

_MOSTLY_KNOWN = 0.7  # chosen: share of the tracks on objects that have moved before


_LARGEST_NOISE = 0.5
"""Noise of a bias along and about an axis from which on nothing shows it [m, rad].

Derived: half of the 1 m and 1 rad that are the prior of every motion."""


@dataclass(frozen=True, eq=False)
class SensorBias:
    """
    Bias between keypoints and depth: the pose by keypoints alone less that by depth alone.

    :param difference: 6 (x, y, z, rot x, rot y, rot z), to first order [m, rad].
    :param covariance: 6x6, of the difference if it is caused by noise alone, as both scatter.
    :param gain: 6x6, by which the joint pose follows depth; keypoints by the rest.
    :param expected_covariance: likewise, by the scatter that is expected of both.
    """

    difference: np.ndarray
    covariance: np.ndarray
    gain: np.ndarray
    expected_covariance: np.ndarray

    @cached_property
    def normalised(self) -> float:
        """Square of the difference by its covariance, per degree of freedom; noise gives 1."""
        return float(self.difference @ definite.solve(self.covariance, self.difference)) / 6

    @cached_property
    def least_normalised(self) -> float:
        """The same by the sum of both covariances: few points may scatter little by chance."""
        return float(self.difference @ definite.solve(
            self.covariance + self.expected_covariance, self.difference)) / 6

    @cached_property
    def squares(self) -> tuple[float, float]:
        """Mean squares of the difference along an axis and about an axis [m^2, rad^2]."""
        shift, turn = self.difference[:3], self.difference[3:]
        return float(shift @ shift) / 3, float(turn @ turn) / 3

    @property
    def is_shown(self) -> bool:
        """Noise small enough to show a bias: not where surfaces leave all motions open."""
        variances = np.diagonal(self.covariance).reshape(2, 3).mean(axis=1)
        return bool((variances < _LARGEST_NOISE ** 2).all())

    def since(self, before: SensorBias, arm: np.ndarray, own: float,
              rotation: np.ndarray) -> SensorBias:
        """
        Return what the bias of a motion is, by those of two poses in one frame, in its axes.

        Its covariances are both by the scatter expected.

        :param before: of the first pose.
        :param arm: from the first pose to the second one, 3 [m].
        :param own: share of the noise of each that the other one does not have.
        :param rotation: of the first pose, 3x3.
        """
        difference, (covariance, gain) = np.empty(6), np.empty((2, 6, 6))
        kernels.bias_since(
            self.difference, self.expected_covariance, self.gain, before.difference,
            before.expected_covariance, arm, own, rotation, difference, covariance, gain)
        return SensorBias(difference, covariance, gain, covariance)


@dataclass(frozen=True, eq=False)
class Fit:
    """
    Fit of two images to a pose.

    :param squared_errors: K, of the tracks that agree with it, in units of their variance.
    :param scene_share: share of the points of the depth image that are not on objects which move
        by themselves.
    :param known_share: share of these tracks that are on objects which have moved before.
    :param objects: that move, or have moved shortly before; None without any.
    """

    squared_errors: np.ndarray
    scene_share: float
    known_share: float = 0.0
    objects: FoundObjects | None = None

    @property
    def has_objects(self) -> bool:
        """Objects that move by themselves have been dropped."""
        return self.scene_share < 1.0

    @property
    def is_of_known_objects(self) -> bool:
        """Most of the tracks are on objects that have moved before."""
        return self.known_share > _MOSTLY_KNOWN


class Evidence(Enum):
    """Measurements that support the pose of a registration."""

    KEYPOINTS = 'keypoints that agree with the pose'
    DEPTH = 'depth and brightness of most of the view, whatever the number of keypoints'
    DEPTH_ALONE = 'depth, and the motion expected where the scene has no shape'
    COLOUR_ALONE = 'keypoints of the target that the source sees, whatever its depth'


@dataclass(frozen=True, eq=False)
class Registration:
    """
    Pose of the source camera in the frame of the target camera.

    :param status: OK, or why there is no pose; ``reason`` adds the numbers.
    :param T_target_source: 4x4 float64 [m]; the identity where the status is not OK, unless it is
        rough.
    :param covariance: 6x6 (x, y, z, rot x, rot y, rot z) about the target's fixed axes
        [m^2, m rad, rad^2]; infinite on the diagonal where the status is not OK.
    :param matches: Kx2, rows (source keypoint, target keypoint) of the last iteration of AICK.
    :param iterations: number of iterations of AICK.
    :param support: number of keypoints that agree with the pose.
    :param bias: between keypoints and depth; None unless a refinement used both.
    :param tracks: keypoints of the source that the refinement found in the target; None without
        a refinement.
    :param evidence: what supports the pose, where the status is OK.
    :param systematic: 6x6, the part of the covariance that is the bias expected between keypoints
        and depth; registrations with about the same motion have it in common.
    :param unusual: 6x6, the part that is an unusual bias, or due to an uncertain delay; what
        keypoints and depth differ by between two registrations shows it too.
    :param timing: 6x6, the part that is due to errors of the two stamps; the pose of one image in
        the other does not have it.
    :param measure: measures what the residuals show of the camera; None unless a refinement used
        both.
    :param overlap: share of the points of the depth image that the other one shows, where it is
        measured: by depth alone.
    :param is_rough: whether it is the first part of a registration, which has to go on from there;
        where the status is not OK, whether AICK, or other keypoints, may confirm the pose.
    :param fit: of the tracks; None without a refinement.
    :param by_readout: 6, by how much the pose errs by the readout of colour that is not corrected
        [m/s, rad/s].
    """

    status: Status
    reason: str
    T_target_source: np.ndarray
    covariance: np.ndarray
    matches: np.ndarray
    iterations: int
    support: int = 0
    bias: SensorBias | None = None
    tracks: Tracks | None = None
    evidence: Evidence = Evidence.KEYPOINTS
    systematic: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    unusual: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    timing: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    measure: Measure | None = None
    overlap: float = 1.0
    is_rough: bool = False
    fit: Fit | None = None
    by_readout: np.ndarray = field(default_factory=lambda: np.zeros(6))

    @property
    def is_by_depth(self) -> bool:
        """Depth alone gave the pose."""
        return self.evidence is Evidence.DEPTH_ALONE

    @property
    def is_by_colour(self) -> bool:
        """Colour alone gave the pose, with the depth of the target."""
        return self.evidence is Evidence.COLOUR_ALONE

    @cached_property
    def pose(self) -> PoseWithCovariance:
        """``T_target_source`` with its covariance."""
        return PoseWithCovariance(self.T_target_source, self.covariance)

    @cached_property
    def image_pose(self) -> PoseWithCovariance:
        """``T_target_source`` with the covariance of the two images, whenever they were taken."""
        return self.pose.with_covariance(self.covariance - self.timing)

    @cached_property
    def varying_pose(self) -> PoseWithCovariance:
        """``T_target_source`` of the two images, with the covariance of what they do not share."""
        return self.pose.with_covariance(self.covariance - self.timing - self.systematic)

    @cached_property
    def unbiased_pose(self) -> PoseWithCovariance:
        """``T_target_source`` of the two images, with the covariance of all but biases."""
        return self.pose.with_covariance(
            self.covariance - self.timing - self.systematic - self.unusual)


def failed(status: Status, reason: str, iterations: int = 0) -> Registration:
    """Return a registration without a pose."""
    return Registration(status, reason, np.eye(4), unknown_covariance(),
                        np.empty((0, 2), np.intp), iterations)
