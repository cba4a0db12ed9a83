# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Projection of whole images of points, fast for distorted cameras too."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.geometry.camera import Camera

_CELL = 2  # px between two nodes of the table, roughly
_WIDEST = 4.0  # of the tangent: what a camera sees beyond 76 degrees off its axis is left out
_RETURNS_WITHIN = 1e-3  # on the plane z = 1; what returns elsewhere was folded into the image


class PixelMap:
    """
    Pixels of points on the plane z = 1; a table holds the distortion, and is interpolated.

    Unlike :meth:`Camera.project` it knows where the distortion model ends: beyond, a polynomial
    would fold points from outside the field of view back into the image.
    """

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        if not camera.distortion:
            return
        self._low, extent = _extent(camera)
        rows, columns = 2 + camera.height // _CELL, 2 + camera.width // _CELL
        self._scale = np.array([columns - 1, rows - 1]) / extent
        row, column = np.mgrid[:rows, :columns]
        nodes = self._low + np.column_stack([column.ravel(), row.ravel()]) / self._scale
        pixels = camera.project(np.column_stack([nodes, np.ones(len(nodes))]))
        off = np.abs(camera.normalize(pixels) - nodes).max(axis=1)
        pixels[~(off < _RETURNS_WITHIN)] = np.nan
        self._u, self._v = np.ascontiguousarray(
            pixels.T.reshape(2, rows, columns), np.float32)

    def pixels(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return where points are seen.

        :param x: HxW float32, on the plane z = 1; ``y`` likewise.
        :returns: u and v, HxW float32 [px]; NaN where the camera sees none of it.
        """
        camera = self._camera
        if not camera.distortion:
            return (x * np.float32(camera.fx) + np.float32(camera.cx),
                    y * np.float32(camera.fy) + np.float32(camera.cy))
        column = (x - np.float32(self._low[0])) * np.float32(self._scale[0])
        row = (y - np.float32(self._low[1])) * np.float32(self._scale[1])
        return tuple(cv2.remap(table, column, row, cv2.INTER_LINEAR,
                               borderMode=cv2.BORDER_CONSTANT, borderValue=np.nan)
                     for table in (self._u, self._v))


def _extent(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return corner and size of what a camera sees of the plane z = 1, and a little more."""
    v, u = np.mgrid[:camera.height:_CELL, :camera.width:_CELL]
    seen = np.clip(camera.normalize(np.column_stack([u.ravel(), v.ravel()])), -_WIDEST, _WIDEST)
    low, high = np.nanmin(seen, axis=0), np.nanmax(seen, axis=0)
    border = 0.02 * (high - low)
    return low - border, high - low + 2 * border
