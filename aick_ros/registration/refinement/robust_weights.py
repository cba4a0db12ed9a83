# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Constants of the robust weights of residuals, as the kernels take them.

At most half of the residuals are outliers. The robust weights are those of the cost of Geman and
McClure (1985): a quarter at the width. Errors of calibration and shutter, which the noise model
lacks, enlarge all residuals of some pairs of frames. The width grows with their median, so that a
few consistent residuals cannot outweigh the rest.

Tracks may be on an object that moves by itself and has most of the keypoints. There the smallest
third of the residuals shows what is noise: what is far beyond it has no weight, so that an object
does not carry the pose with it.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

LARGEST_SCALE = 4.0  # chosen: of the residuals of a right pose, in units of their noise
_SMALLEST_SCALE = 0.25
"""Likewise, of tracks of which those that are far off are on an object that moves by itself.

Chosen on rendered rooms through which a board passes: with 0.5 it moves a camera at rest by twice
as much; on two excerpts of real recordings and twelve rendered ones trajectories are the same."""

_OTHER_MOTION = 3.0  # chosen: robust widths from which on a track is another motion's
MEDIAN_1 = NormalDist().inv_cdf(0.75) ** 2
"""Median of chi-square with one degree of freedom; derived."""

MEDIAN_2 = 2.0 * math.log(2.0)
"""Median of chi-square with two degrees of freedom; derived."""


def robustness(width: float, median: float) -> np.ndarray:
    """
    Return the width of robust weights and what bounds it, as the kernels take it, 3.

    :param width: in standard deviations.
    :param median: of the squares by noise alone.
    """
    return np.array([width, median, LARGEST_SCALE ** 2])


def truncation(width: float) -> np.ndarray:
    """Return the limits that separate tracks of another motion, as the kernels take them, 2."""
    return np.array([_OTHER_MOTION * width, _SMALLEST_SCALE ** 2])
