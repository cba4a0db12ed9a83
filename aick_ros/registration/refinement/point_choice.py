# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether points that face all ways alike, or points all over the image, show a motion best.

By default all directions of the normals have a like number of points, so that small surfaces
count as much as walls. What is best depends on the camera. Where depth is distorted by as much as
that of a Kinect, large planes err the most, each by an amount of its own. Where it is not, planes
are exact and what is fitted to small surfaces is worse: it changes with the view.

Both errors are alike across a part of the image. So they show in the variance between its blocks,
beyond that by the noise of single points: that on planes which few cells face as, by that on
planes which many do (variance components of a one-way layout).
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.surface import Surface
from aick_ros.geometry.median import median
from aick_ros.registration.refinement.residuals import PlaneResiduals
from aick_ros.registration.refinement.robust_weights import MEDIAN_1

# All chosen on two excerpts of real recordings and on rendered rooms with four kinds of cameras.
_RARE, _COMMON = 0.04, 0.06  # share of the cells that face alike: below, and above
_FEWEST_POINTS, _FEWEST_BLOCKS = 20, 4  # of either kind
_FEWEST_IN_BLOCK = 5
_LARGEST_SQUARE = 4.0  # of the mean of a block, as a ratio to the median of all
_LARGEST = 3.0  # logarithm of the ratio that one registration shows
_MEMORY, _PRIOR_COUNT = 60, 10  # registrations; the prior says that both are alike
_ALL_OF, _LATER_EVERY = 40, 4
"""Registrations that are all looked at, and one of how many after them: that takes time."""

_EVEN_FROM, _BALANCED_FROM = 0.75, -0.5
"""Mean logarithm from which points are spread evenly, and from which they are balanced again."""


class PointChoice:
    """Learns over the registrations of a camera which points to take."""

    def __init__(self) -> None:
        self.is_even = False
        """Choice of points all over the image, as many as there are of the others."""
        self._begin()

    def _begin(self) -> None:
        self._mean, self._count, self._asked = 0.0, _PRIOR_COUNT, 0

    def of(self, surface: Surface) -> Surface:
        """Return a surface with the points to take."""
        return surface.even if self.is_even else surface

    def shown_by(self, residuals: PlaneResiduals, target: Surface) -> float | None:
        """Return what a registration shows, as :func:`log_ratio`; None where it is skipped."""
        self._asked += 1
        if self._asked > _ALL_OF and self._asked % _LATER_EVERY:
            return None
        return log_ratio(residuals, target)

    def learn(self, shown: float) -> None:
        """Learn what a registration has shown."""
        self._count = min(self._count + 1, _MEMORY)
        self._mean += (shown - self._mean) / self._count
        if self._mean < _BALANCED_FROM if self.is_even else self._mean > _EVEN_FROM:
            self.is_even = not self.is_even
            self._begin()


def log_ratio(residuals: PlaneResiduals, target: Surface) -> float | None:
    """
    Return the logarithm of the variance between blocks on rare planes, by that on common ones.

    :param target: the surface with the planes.
    :returns: None where one of both kinds has too few points.
    """
    directions = residuals.directions
    lengths = np.sqrt(np.einsum('ij,ij->i', directions, directions))
    shares = target.shares_facing(directions / np.maximum(lengths, 1e-12)[:, None])
    variances = [_between_blocks(residuals.values[kind], residuals.blocks[kind])
                 for kind in (shares < _RARE, shares > _COMMON)]
    rare, common = variances
    if rare is None or common is None:
        return None
    if not (rare > 0.0 and common > 0.0):
        return _LARGEST * float(np.sign(rare - common))
    return min(max(math.log(rare / common), -_LARGEST), _LARGEST)


def _between_blocks(values: np.ndarray, blocks: np.ndarray) -> float | None:
    """Return the variance of the means of blocks beyond that by single values, at least 0."""
    if len(values) < _FEWEST_POINTS:
        return None
    counts = np.bincount(blocks)
    chosen = counts >= _FEWEST_IN_BLOCK
    sizes = counts[chosen]
    if len(sizes) < _FEWEST_BLOCKS:
        return None
    squares = (np.bincount(blocks, values)[chosen] / sizes) ** 2
    squares = np.minimum(squares, _LARGEST_SQUARE * median(squares) / MEDIAN_1)
    noise = median(values * values) / MEDIAN_1
    return max(float((squares - noise / sizes).sum()) / len(sizes), 0.0)
