# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth of a camera beside the colour camera, as the colour camera would have measured it."""

from __future__ import annotations

import itertools

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pixel_map import PixelMap

_OVERLAP = 1.1  # of the footprints of two neighbours, so that slanted surfaces have no cracks
_LONGEST_REACH = np.float32(8.0)  # px to each side; a damaged camera_info must not ask for more
_JUMP = 0.05  # relative difference of depth to a neighbour that counts as an edge


class DepthToColour:
    """
    Projects depth images into the image of the colour camera.

    A pixel of the depth image covers as many of the colour image as its size and the two focal
    lengths tell. Where several fall on one, the nearest counts. Within a footprint the depth
    follows the surface's slope, whose inverse depth is linear in the image.

    :param depth_camera: that took the depth images.
    :param colour_camera: in whose image they are wanted.
    :param T_colour_depth: 4x4, between the two optical frames.
    """

    def __init__(self, depth_camera: Camera, colour_camera: Camera,
                 T_colour_depth: np.ndarray) -> None:
        self._colour_camera, self._map = colour_camera, PixelMap(colour_camera)
        height, width = depth_camera.height, depth_camera.width
        v, u = np.mgrid[:height, :width]
        rays = np.column_stack([
            depth_camera.normalize(np.column_stack([u.ravel(), v.ravel()])), np.ones(u.size)])
        self._rays = np.ascontiguousarray(
            (rays @ T_colour_depth[:3, :3].T).T, np.float32).reshape(3, height, width)
        self._origin = T_colour_depth[:3, 3].astype(np.float32).reshape(3, 1, 1)
        # how far a step of one depth pixel goes in the colour image; parallax is little beside it
        self._step = (np.diag((colour_camera.fx, colour_camera.fy)) @ T_colour_depth[:2, :2]
                      @ np.diag((1 / depth_camera.fx, 1 / depth_camera.fy)))

    def reproject(self, depth: np.ndarray) -> np.ndarray:
        """
        Return a depth image as seen by the colour camera.

        :param depth: hxw float32 as the depth camera has it, z [m]; NaN where there is none.
        :returns: HxW float32, z in the colour camera [m]; NaN where none is measured.
        """
        with np.errstate(divide='ignore', invalid='ignore'):
            x, y, z = self._rays * depth + self._origin
            inverse = np.where(z > 0.0, 1.0 / z, np.float32(0.0))
            u, v = self._map.pixels(x * inverse, y * inverse)
        return self._splat(u, v, inverse)

    def _splat(self, u: np.ndarray, v: np.ndarray, inverse: np.ndarray) -> np.ndarray:
        """Return the greatest of the inverse depths that cover each pixel, as depth."""
        width, height = self._colour_camera.width, self._colour_camera.height
        reach = (0.5 * _OVERLAP * np.abs(self._step).sum(axis=1)).astype(np.float32)
        reach = np.minimum(reach, _LONGEST_REACH)
        margin = int(2 * reach.max()) + 1
        left, top = np.ceil(u - reach[0]), np.ceil(v - reach[1])
        seen = np.flatnonzero((inverse > 0.0) & (left >= -margin) & (left < width)
                              & (top >= -margin) & (top < height))
        u, v, left, top, inverse, right_slope, down_slope = (
            a.reshape(-1)[seen] for a in (u, v, left, top, inverse, *self._slopes(inverse)))
        inverse = inverse + right_slope * (left - u) + down_slope * (top - v)
        columns, rows = np.floor(u + reach[0]) - left, np.floor(v + reach[1]) - top
        stride = width + 2 * margin
        index = (top.astype(np.intp) + margin) * stride + left.astype(np.intp) + margin
        nearest = np.zeros((height + 2 * margin) * stride, np.float32)
        for right, down in itertools.product(*(range(int(2 * r) + 1) for r in reach)):
            covered = np.flatnonzero((columns >= right) & (rows >= down))
            np.maximum.at(nearest, index[covered] + (down * stride + right),
                          inverse[covered] + right * right_slope[covered]
                          + down * down_slope[covered])
        nearest = nearest.reshape(-1, stride)[margin:-margin, margin:-margin]
        return np.divide(1.0, nearest, out=np.full_like(nearest, np.nan), where=nearest > 0.0)

    def _slopes(self, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the change of inverse depth with the colour image's u and v; 0 at edges."""
        right, down = _difference(inverse, axis=1), _difference(inverse, axis=0)
        (a, b), (c, d) = np.linalg.inv(self._step).astype(np.float32)
        return a * right + c * down, b * right + d * down


def _difference(inverse: np.ndarray, axis: int) -> np.ndarray:
    """Return the change of inverse depth a pixel; 0 beside edges, holes and the border."""
    lines = inverse if axis == 1 else inverse.T
    before, after = lines[:, :-2], lines[:, 2:]
    change = after - before
    smooth = (before > 0.0) & (after > 0.0) & (np.abs(change) <= _JUMP * lines[:, 1:-1])
    difference = np.zeros_like(lines)
    difference[:, 1:-1] = np.where(smooth, 0.5 * change, 0.0)
    return difference if axis == 1 else difference.T
