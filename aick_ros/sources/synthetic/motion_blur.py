# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motion blur of images taken while the camera moves."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera

_MOST_TAPS = 9


def motion_blur(colour: np.ndarray, depth: np.ndarray, camera: Camera,
                T_start_end: np.ndarray) -> np.ndarray:
    """
    Return an image blurred along the motion of its pixels during the exposure.

    :param colour: HxWx3 uint8, of the middle of the exposure.
    :param depth: HxW float32 [m].
    :param T_start_end: motion of the camera during the exposure, 4x4.
    """
    flow_u, flow_v = optical_flow(depth, camera, se3.log(T_start_end).astype(np.float32))
    longest = float(np.sqrt(np.max(flow_u ** 2 + flow_v ** 2)))
    taps = min(_MOST_TAPS, int(np.ceil(longest)))
    if taps < 2:
        return colour
    rows, columns = np.indices(depth.shape, np.float32)
    total = np.full(colour.shape, taps // 2, np.uint16)
    for share in (np.arange(taps, dtype=np.float32) + np.float32(0.5)) / taps - np.float32(0.5):
        moved: np.ndarray = cv2.remap(
            colour, columns + share * flow_u, rows + share * flow_v, cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE)
        total += moved
    return (total // taps).astype(np.uint8)


def optical_flow(depth: np.ndarray, camera: Camera,
                 twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the optical flow, u and v, each HxW [px], of a small twist of the camera."""
    right, down, forward, *turn = twist
    x = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(np.float32)
    y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)[:, None]
    inverse = np.nan_to_num(1 / depth, nan=0.0)
    swing = turn[0] * y - turn[1] * x
    flow_x = inverse * (x * forward - right) - turn[1] + turn[2] * y + x * swing
    flow_y = inverse * (y * forward - down) + turn[0] - turn[2] * x + y * swing
    return np.float32(camera.fx) * flow_x, np.float32(camera.fy) * flow_y
