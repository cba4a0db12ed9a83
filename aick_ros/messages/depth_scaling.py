# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth images that are smaller than their colour images by an integer factor."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.errors import InputError
from aick_ros.messages.depth_units import EDGE


def enlarge(depth: np.ndarray, width: int, height: int,
            register_depth: str = 'register_depth') -> np.ndarray:
    """
    Return a depth image at the size of its colour image.

    Each pixel becomes a block. On a surface the inverse depth is interpolated between the centres
    of the blocks, which is exact on a plane. At edges and holes a block has the depth of its
    pixel, since a depth between two surfaces would lie on neither.

    :param depth: hxw float32 [m], NaN where there is no depth.
    :param width: of the colour image [px]; ``height`` likewise.
    :param register_depth: in error messages, what to set so that depth is registered.
    :returns: HxW float32 [m]; ``depth`` itself where the sizes are equal.
    :raises InputError: where the factor is not an integer, or not the same in both directions.
    """
    rows, columns = depth.shape
    factor = height // rows if rows else 0
    if (rows, columns) == (height, width):
        return depth
    if factor < 1 or (factor * rows, factor * columns) != (height, width):
        raise InputError(
            f'colour is {width} x {height} and depth {columns} x {rows} pixels, which is neither '
            'its size nor smaller by a whole factor: use the depth registered to the colour '
            f'camera, or register it here ({register_depth})')
    inverse = np.nan_to_num(1.0 / depth, nan=0.0)
    square = np.ones((3, 3), np.uint8)
    nearest, farthest = cv2.dilate(inverse, square), cv2.erode(inverse, square)
    smooth = nearest <= (1.0 + EDGE) * farthest
    blocks = np.ones((factor, factor), np.float32)
    inverse = np.where(np.kron(smooth, blocks),
                       cv2.resize(inverse, (width, height), interpolation=cv2.INTER_LINEAR),
                       np.kron(inverse, blocks))
    return np.divide(1.0, inverse, out=np.full_like(inverse, np.nan), where=inverse > 0.0)
