# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames as a pinhole camera without distortion sees them."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import cv2
import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pixel_map import PixelMap

_OUTSIDE = np.float32(-2.0)  # by definition: a pixel beyond the border of any image


def rectified(frame: RgbdFrame) -> RgbdFrame:
    """
    Return the frame of a camera of the same focal lengths and centre without distortion.

    Colours are interpolated, depths taken from the nearest pixel; what the camera has not seen is
    black and without depth. The frame is no masked one, whose hidden part is another one here.
    """
    if not frame.camera.distortion:
        return frame
    u, v = _source_pixels(frame.camera)
    return RgbdFrame(
        frame.stamp, camera=_without_distortion(frame.camera), depth_stamp=frame.depth_stamp,
        imu=frame.imu,
        colour=cv2.remap(frame.colour, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
                         borderValue=(0, 0, 0)),
        depth=cv2.remap(frame.depth, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT,
                        borderValue=(np.nan,)))


def rectified_pixels(camera: Camera, pixels: np.ndarray) -> np.ndarray:
    """Return where pixels of a camera, Nx2, lie in its rectified image, Nx2 [px]."""
    if not camera.distortion:
        return pixels
    return camera.normalize(pixels) * (camera.fx, camera.fy) + (camera.cx, camera.cy)


def _without_distortion(camera: Camera) -> Camera:
    return dataclasses.replace(camera, distortion=(), distortion_model='plumb_bob')


@lru_cache(maxsize=1)
def _source_pixels(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return u and v of the camera's image for each pixel of the rectified one, HxW float32."""
    v, u = np.mgrid[:camera.height, :camera.width]
    x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    # where a distortion model has no ray, its polynomial still has a pixel
    is_seen = np.isfinite(PixelMap(camera).pixels(
        x.astype(np.float32), y.astype(np.float32))).all(axis=0)
    pixels = camera.project(np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3))
    u, v = pixels.T.reshape(2, *x.shape).astype(np.float32)
    return np.where(is_seen, u, _OUTSIDE), np.where(is_seen, v, _OUTSIDE)
