# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Bias of increments between keypoints and depth, learned over the increments of one camera.

What two registrations to one keyframe have in common is no error of the motion between them: the
bias that one registration shows says little about an increment. The difference of the two biases
does: by how much more the motion by keypoints differs from that by depth than noise lets expect.
It grows with the motion, as where depth is registered to colour by a wrong angle.

Its ratio to the motion is a variance component, estimated by Fisher's scoring: what the kinds
differ by along a direction that one of them hardly observes is expected of its noise, and says
little of the bias.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.result import SensorBias

# All chosen on two excerpts of real recordings and on rendered rooms with five kinds of cameras.
_PRIOR = math.radians(2.0) ** 2
_PRIOR_COUNT = 1  # increments that the prior counts for
_MEMORY = 30  # increments that the mean is over
_LARGEST_CHANGE = 4.0  # of the estimate by one increment, and of its inverse
_SMALLEST = math.radians(0.001) ** 2  # of an estimate; from it few increments let it grow
_SMALLEST_MOTION = 0.001  # rad; smaller displacements of the image show noise alone
_NOISE = 0.7
"""Variance of an increment by noise, as a ratio to what the scatter of the residuals shows.

Neighbours are matched to the keyframe alike: more than its noise is common to both. What keypoints
and depth differ by has all of its noise, on cameras without a bias rather more."""

_OF_DEPTH = 0.85
"""Share of the biases that are depth's. On rendered cameras all are, on real ones with blur and a
rolling shutter some are of the keypoints."""

_USUAL, _LARGEST = 10.645, 19.805
"""Squares of a difference by its covariance. Up to the first it is usual; beyond, the covariance
grows to what makes it usual. What exceeds the second teaches as if it did not.

Derived: 90 and 99.7 % quantiles of chi-square with six degrees of freedom."""


class IncrementBias:
    """The bias of increments of one camera, in time order."""

    def __init__(self) -> None:
        self._count = _PRIOR_COUNT
        self._ratio = _PRIOR  # mean square of the bias by that of the motion
        self._information = self._score = 0.0

    @property
    def ratio(self) -> float:
        """Bias about an axis by the rotation, as a standard deviation [rad/rad]."""
        return math.sqrt(self._ratio)

    def add_to(self, motion: PoseWithCovariance, shown: SensorBias | None,
               depth: float) -> PoseWithCovariance:
        """
        Return a motion with the covariance of the bias too, and learn from what it shows.

        :param motion: ``T_camera0_camera1``, with the covariance of all other errors.
        :param shown: the difference of the biases of its two registrations, in the same axes;
            None: not known, and nothing is added.
        :param depth: of the scene [m].
        """
        if shown is None:
            return motion
        squares, covariance = _squares(motion.matrix, depth), np.empty((6, 6))
        seen = kernels.biased_increment(
            shown.difference, shown.expected_covariance, shown.gain, squares, self._ratio,
            motion.covariance, _OF_DEPTH, _NOISE, _USUAL, _LARGEST, covariance)
        if seen is None:  # what keypoints and depth differ by has no covariance
            return motion
        if squares[0] >= (_SMALLEST_MOTION * depth) ** 2:
            self._learn(*seen)
        return motion.with_covariance(covariance)

    def add_to_depth_alone(self, motion: PoseWithCovariance, depth: float) -> PoseWithCovariance:
        """
        Return a motion by depth alone, which has all of depth's share, with the covariance of it.

        Parameters are as for :meth:`add_to`.
        """
        bias = _OF_DEPTH * self._ratio * np.diag(_squares(motion.matrix, depth))
        return motion.with_covariance(motion.covariance + bias)

    def _learn(self, information: float, score: float) -> None:
        """
        Take a step of Fisher's scoring.

        :param information: about the ratio.
        :param score: derivative of the logarithm of the likelihood by the ratio.
        """
        if not self._information:
            self._information, self._score = information, information * self._ratio
        self._count = min(self._count + 1, _MEMORY)
        self._information += (information - self._information) / self._count
        self._score += (information * self._ratio + score - self._score) / self._count
        self._ratio = max(min(max(self._score / self._information,
                                  self._ratio / _LARGEST_CHANGE),
                              self._ratio * _LARGEST_CHANGE), _SMALLEST)


def _squares(motion: np.ndarray, depth: float) -> np.ndarray:
    """Return the squares that a bias has for one radian of misregistration, 6 [m^2, rad^2]."""
    turn = se3.angle(motion[:3, :3]) ** 2
    shift = float(motion[:3, 3] @ motion[:3, 3]) + depth ** 2 * turn
    return np.array([shift, shift, shift, turn, turn, turn])
