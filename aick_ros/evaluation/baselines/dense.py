# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Input of the dense methods: point clouds, and images of an ideal pinhole camera."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera


def point_cloud(frame: RgbdFrame, max_depth: float) -> np.ndarray:
    """
    Return the points of the depth image, Nx3 float64 in the optical frame [m].

    :param max_depth: farther points are ignored [m].
    """
    rays = _rays(frame.camera)
    depths = frame.depth.ravel().astype(np.float64)
    with np.errstate(invalid='ignore'):
        kept = (depths > 0) & (depths < max_depth) & np.isfinite(rays[:, 0])
    return np.column_stack([rays[kept] * depths[kept, None], depths[kept]])


def undistorted(frame: RgbdFrame) -> tuple[np.ndarray, np.ndarray]:
    """
    Return colour and depth of a camera with the same matrix and no distortion.

    Depth is taken from the nearest pixel, as interpolation would join separate surfaces.

    :returns: HxWx3 or HxW uint8, and HxW float32 [m], NaN where there is none.
    """
    if not frame.camera.distortion:
        return frame.colour, frame.depth
    columns, rows = _undistortion(frame.camera)
    colour = cv2.remap(frame.colour, columns, rows, cv2.INTER_LINEAR)
    depth = cv2.remap(frame.depth, columns, rows, cv2.INTER_NEAREST, borderValue=float('nan'))
    return colour, depth


def _pixels(camera: Camera) -> np.ndarray:
    v, u = np.mgrid[:camera.height, :camera.width]
    return np.column_stack([u.ravel(), v.ravel()]).astype(np.float64)


@lru_cache(maxsize=1)
def _rays(camera: Camera) -> np.ndarray:
    return camera.normalize(_pixels(camera))


@lru_cache(maxsize=1)
def _undistortion(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns and rows of the ideal camera's pixels in the image, HxW each."""
    rays = (_pixels(camera) - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    seen = camera.project(np.column_stack([rays, np.ones(len(rays))])).astype(np.float32)
    columns, rows = seen.T.reshape(2, camera.height, camera.width)
    return np.ascontiguousarray(columns), np.ascontiguousarray(rows)
