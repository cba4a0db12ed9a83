# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which keypoints to keep where there are more than are wanted."""

from __future__ import annotations

import numpy as np


def spread(pixels: np.ndarray, count: int, cell_size: float) -> np.ndarray:
    """
    Return the keypoints to keep: as evenly from all cells of a grid as there are keypoints.

    Strong keypoints crowd on a few textured things, and what they say of the camera's motion is
    then much the same. So the strongest of each cell come first, then the second of each.

    :param pixels: Nx2 (u, v) [px], the strongest first.
    :param cell_size: side of a cell [px].
    :returns: indices, at most ``count``, the strongest first.
    """
    column, row = (pixels // cell_size).astype(np.intp).T
    cell = row * (column.max(initial=0) + 1) + column
    by_cell = np.argsort(cell, kind='stable')
    _, starts, lengths = np.unique(cell[by_cell], return_index=True, return_counts=True)
    rank = np.empty(len(cell), np.intp)
    rank[by_cell] = np.arange(len(cell)) - np.repeat(starts, lengths)
    return np.sort(np.argsort(rank, kind='stable')[:count])
