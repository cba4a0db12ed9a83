# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Selection of keypoints spread evenly over the image."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels


def spread(pixels: np.ndarray, count: int, cell_size: float) -> np.ndarray:
    """
    Return the keypoints to keep, spread as evenly as possible over the cells of a grid.

    Strong keypoints cluster on a few textured objects and then constrain the motion poorly. So the
    strongest of each cell are kept first, then the second of each, and so on.

    :param pixels: Nx2 (u, v) [px], the strongest first.
    :param count: maximum number of keypoints.
    :param cell_size: side of a cell [px].
    :returns: indices, the strongest first.
    """
    chosen = np.empty(min(count, len(pixels)), np.int64)
    kernels.spread(pixels, cell_size, chosen)
    return chosen
