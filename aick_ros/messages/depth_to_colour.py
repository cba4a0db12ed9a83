# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth images of a separate depth camera, reprojected into the image of the colour camera."""

from __future__ import annotations

import itertools

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pixel_map import PixelMap
from aick_ros.messages.depth_units import EDGE

_OVERLAP = 1.1  # scale of the footprints, so that slanted surfaces have no cracks; chosen
_LARGEST_HALF_WIDTH = 8.0  # of a footprint [px]; chosen, bounds the time of a frame
_SMALLEST_AREA = 1e-9  # of a depth pixel [colour px^2]; chosen: on edge it has no slope


class DepthToColour:
    """
    Reprojects depth images into the image of the colour camera.

    Each pixel of the depth image becomes a rectangle in the colour image, its footprint, whose
    size follows from the two focal lengths, and from the distortion about the pixel. Where
    footprints overlap, the nearest surface wins. Within a footprint the inverse depth is linear
    in the image, as on a plane.

    :param depth_camera: camera of the depth images.
    :param colour_camera: camera of the colour images.
    :param T_colour_depth: 4x4, from the depth to the colour camera's optical frame.
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
        with np.errstate(over='ignore', invalid='ignore'):  # a damaged camera_info
            steps = _steps(depth_camera, colour_camera, T_colour_depth[:3, :3], self._rays)
            half_sizes = 0.5 * _OVERLAP * np.abs(steps).sum(axis=1)
            self._inverse_steps = _inverses(steps).astype(np.float32)
        self._half_sizes = np.minimum(half_sizes, _LARGEST_HALF_WIDTH).astype(np.float32)

    def reproject(self, depth: np.ndarray) -> np.ndarray:
        """
        Return a depth image as the colour camera would have measured it.

        :param depth: hxw float32, z in the depth camera [m]; NaN where there is no depth.
        :returns: HxW float32, z in the colour camera [m]; NaN where there is no depth.
        """
        with np.errstate(divide='ignore', invalid='ignore'):
            x, y, z = self._rays * depth + self._origin
            inverse = np.where(z > 0.0, 1.0 / z, np.float32(0.0))
            u, v = self._map.pixels(x * inverse, y * inverse)
        return self._splat(u, v, inverse)

    def _splat(self, u: np.ndarray, v: np.ndarray, inverse: np.ndarray) -> np.ndarray:
        """
        Return the depth of the nearest footprint at each pixel, HxW float32 [m].

        :param u: column in the colour image of each depth pixel, hxw float32 [px]; ``v``: row.
        :param inverse: inverse depth in the colour camera, hxw float32 [1/m]; 0 for none.
        """
        width, height = self._colour_camera.width, self._colour_camera.height
        half_width, half_height = self._half_sizes
        margin = int(2 * self._half_sizes.max()) + 1
        left, top = np.ceil(u - half_width), np.ceil(v - half_height)
        seen = np.flatnonzero((inverse > 0.0) & (left >= -margin) & (left < width)
                              & (top >= -margin) & (top < height))
        u, v, left, top, inverse, right_slope, down_slope = (
            a.reshape(-1)[seen] for a in (u, v, left, top, inverse, *self._slopes(inverse)))
        half_width, half_height = (
            a.reshape(-1) if a.size == 1 else a.reshape(-1)[seen] for a in self._half_sizes)
        inverse = inverse + right_slope * (left - u) + down_slope * (top - v)
        columns, rows = np.floor(u + half_width) - left, np.floor(v + half_height) - top
        stride = width + 2 * margin
        index = (top.astype(np.intp) + margin) * stride + left.astype(np.intp) + margin
        nearest = np.zeros((height + 2 * margin) * stride, np.float32)
        for right, down in itertools.product(range(_most(columns)), range(_most(rows))):
            covered = np.flatnonzero((columns >= right) & (rows >= down))
            np.maximum.at(nearest, index[covered] + (down * stride + right),
                          inverse[covered] + right * right_slope[covered]
                          + down * down_slope[covered])
        nearest = nearest.reshape(-1, stride)[margin:-margin, margin:-margin]
        return np.divide(1.0, nearest, out=np.full_like(nearest, np.nan), where=nearest > 0.0)

    def _slopes(self, inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the change of inverse depth per column and row of colour; 0 at edges."""
        right, down = _difference(inverse, axis=1), _difference(inverse, axis=0)
        (a, b), (c, d) = self._inverse_steps
        return a * right + c * down, b * right + d * down


def _steps(depth_camera: Camera, colour_camera: Camera, R_colour_depth: np.ndarray,
           rays: np.ndarray) -> np.ndarray:
    """
    Return d(colour pixel) / d(depth pixel) of distant points; parallax changes it little.

    :param rays: of the depth pixels, in the colour camera's optical frame, 3xhxw.
    :returns: 2x2xhxw; 2x2x1x1, that of the centre, where neither camera has a distortion.
    """
    pixel_of_ray = np.diag((colour_camera.fx, colour_camera.fy))
    ray_of_pixel = np.diag((1 / depth_camera.fx, 1 / depth_camera.fy))
    centre = np.asarray(pixel_of_ray @ R_colour_depth[:2, :2] @ ray_of_pixel)[..., None, None]
    if not (depth_camera.distortion or colour_camera.distortion):
        return centre
    pixels = colour_camera.project(rays.reshape(3, -1).T).T.reshape(2, *rays.shape[1:])
    pixels[:, ~(rays[2] > 0.0)] = np.nan
    steps = np.stack([_change(pixels, axis=2), _change(pixels, axis=1)], axis=1)
    return np.where(np.isfinite(steps).all(axis=(0, 1)), steps, centre)


def _change(pixels: np.ndarray, axis: int) -> np.ndarray:
    """Return the change per depth pixel; to one side beside the border, or where it has no ray."""
    before = np.diff(pixels, axis=axis, prepend=np.nan)
    after = np.diff(pixels, axis=axis, append=np.nan)
    both = 0.5 * (before + after)
    one = np.where(np.isfinite(before), before, after)
    return np.where(np.isfinite(both), both, one)


def _inverses(steps: np.ndarray) -> np.ndarray:
    """Return the inverses of 2x2 matrices, 2x2x...; zeros where a matrix has none."""
    (a, b), (c, d) = steps
    area = a * d - b * c
    inverses = np.zeros_like(steps)
    np.divide(np.array([[d, -b], [-c, a]]), area, out=inverses,
              where=np.isfinite(area) & (np.abs(area) > _SMALLEST_AREA))
    return inverses


def _most(lengths: np.ndarray) -> int:
    """Return the largest number of pixels on a side of a footprint, at least 1."""
    return int(lengths.max(initial=0.0)) + 1


def _difference(inverse: np.ndarray, axis: int) -> np.ndarray:
    """Return the change of inverse depth per pixel; 0 beside edges, holes and the border."""
    lines = inverse if axis == 1 else inverse.T
    before, after = lines[:, :-2], lines[:, 2:]
    change = after - before
    smooth = (before > 0.0) & (after > 0.0) & (np.abs(change) <= EDGE * lines[:, 1:-1])
    difference = np.zeros_like(lines)
    difference[:, 1:-1] = np.where(smooth, 0.5 * change, 0.0)
    return difference if axis == 1 else difference.T
