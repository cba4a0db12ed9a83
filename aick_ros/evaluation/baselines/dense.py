# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Point clouds, the input of the dense methods."""

from __future__ import annotations

from functools import lru_cache

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


def _pixels(camera: Camera) -> np.ndarray:
    v, u = np.mgrid[:camera.height, :camera.width]
    return np.column_stack([u.ravel(), v.ravel()]).astype(np.float64)


@lru_cache(maxsize=1)
def _rays(camera: Camera) -> np.ndarray:
    return camera.normalize(_pixels(camera))
