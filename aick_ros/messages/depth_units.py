# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth in metres, from and to the numbers that images store."""

from __future__ import annotations

import numpy as np

MILLIMETRES = 1000.0
"""Units per metre of 16UC1 depth images (REP 118)."""

EDGE = 0.05
"""Relative difference of depth to a neighbouring pixel that counts as an edge; chosen."""


def to_metres(units: np.ndarray, units_per_metre: float) -> np.ndarray:
    """
    Return depth in metres.

    :param units: HxW uint16, 0 where there is no depth.
    :returns: HxW float32 [m], NaN where there is no depth.
    """
    depth = units.astype(np.float32)
    depth[depth == 0.0] = np.nan
    depth /= np.float32(units_per_metre)
    return depth


def to_units(depth: np.ndarray, units_per_metre: float) -> np.ndarray:
    """
    Return depth rounded to whole units, the inverse of :func:`to_metres`.

    :param depth: HxW float32 [m].
    :returns: HxW uint16; 0 where there is no depth or 16 bits cannot hold it.
    """
    units = np.rint(depth * np.float32(units_per_metre))
    with np.errstate(invalid='ignore'):
        return np.where((units > 0) & (units < 65536), units, 0).astype(np.uint16)


def valid_metres(depth: np.ndarray) -> np.ndarray:
    """
    Return a copy of a depth image, NaN wherever depth is not positive and finite.

    :param depth: HxW float32 [m], of either byte order.
    :returns: HxW float32 [m], of native byte order.
    """
    depth = depth.astype(np.float32)
    np.copyto(depth, np.nan, where=~((depth > 0.0) & (depth < np.inf)))
    return depth
