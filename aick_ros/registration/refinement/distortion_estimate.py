# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Distortion of a camera's depth images, estimated over its registrations.

It is estimated together with the misalignment, which it could otherwise be taken for. What is not
significant against how far parts of the registrations contradict each other changes nothing, and
what is significant is shrunk by what chance contributes to it (James and Stein 1961).

A distortion that is alike all over the image is hardly observed: it changes little but the scale.
The lens of the colour camera is not estimated with it: the two are too alike.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.depth_distortion import (
    COLUMNS, NO_DISTORTION, ROWS, DepthDistortion, have_same_nodes)
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.grouped_equations import GroupedEquations
from aick_ros.registration.refinement.misalignment_estimate import PRIOR_SIGMAS
from aick_ros.registration.samples import Equations

# All chosen on two excerpts of real recordings, each corrected by what the other shows, and on
# rendered rooms with and without a distortion.
_KEPT = 0.95  # weight of a group's earlier registrations, each time that it is added to
_FEWEST = 40  # registrations before anything is estimated
_GROWTH, _LONGEST = 1.25, 400
"""Registrations of an estimate, as a ratio to those of the one before, and how many come between
two estimates at most: with each change, frames are prepared again."""

_PRIOR_WEIGHT = 100.0  # information by residuals with common errors, as a ratio to what it is
_SIGNIFICANT = 12.5
"""Square of an estimate by its variance, both weighted by the information, from which on it is
applied. Cameras without distortion show 1 to 7, or 15 where depth is misaligned too; those with
one 20 and more after 100 frames."""

_STILL_SIGNIFICANT = 0.5  # of that: below it an estimate is no longer applied

_LENS = len(PRIOR_SIGMAS) - 1
_CHOSEN = np.delete(np.arange(len(PRIOR_SIGMAS) + ROWS * COLUMNS, dtype=np.int64), _LENS)
_NODES = slice(len(PRIOR_SIGMAS), len(PRIOR_SIGMAS) + ROWS * COLUMNS)
"""By definition: behind the misalignment, of which the last is the lens."""

_PRIOR_SIGMAS = np.array([*PRIOR_SIGMAS, *[0.002] * (ROWS * COLUMNS)])  # of a node in 1/m


class DistortionEstimate:
    """Distortion of the depth images of one camera, learned over its registrations."""

    def __init__(self) -> None:
        self._camera: Camera | None = None
        self._forget()

    def _forget(self) -> None:
        self._equations = GroupedEquations(np.diag(_PRIOR_WEIGHT / _PRIOR_SIGMAS ** 2), _KEPT)
        self._distortion = NO_DISTORTION
        self._next = _FEWEST

    @property
    def distortion(self) -> DepthDistortion:
        """Distortion to be corrected; another object only where it is another one."""
        return self._distortion

    def follow(self, camera: Camera) -> None:
        """
        Start anew where a camera shows another image than before, whose nodes lie elsewhere.

        :param camera: of the present frame.
        """
        if self._camera is None or not have_same_nodes(self._camera, camera):
            self._forget()
            self._camera = camera

    def learn(self, equations: Equations, radial: float = 0.0) -> None:
        """
        Add one registration: equations of misalignment and distortion.

        :param radial: coefficient of the lens of the colour camera.
        """
        self._equations.add(equations.information, equations.gradient)
        if self._equations.count >= self._next:
            self._next = min(math.ceil(_GROWTH * self._next), self._next + _LONGEST)
            self._distortion = self._estimate(radial)

    def _estimate(self, radial: float) -> DepthDistortion:
        known = np.zeros(_NODES.stop)
        known[_LENS] = radial
        estimate, scatter = self._equations.solve(_CHOSEN, known)
        significance = self._equations.significance(_NODES, estimate, scatter)
        required = _SIGNIFICANT * (1.0 if self._distortion.is_none else _STILL_SIGNIFICANT)
        if significance < required:
            return NO_DISTORTION
        shrunk = (1.0 - 1.0 / significance) * estimate[_NODES]
        return DepthDistortion(shrunk.reshape(ROWS, COLUMNS))
