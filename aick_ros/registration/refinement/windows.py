# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What the windows around keypoints show, and how a motion displaces it.

A window is tracked as if it moved as a whole. On a slanted surface its pixels do not: it is
stretched, and what is found is the mean of their displacements, weighted by their gradients
(Lucas and Kanade 1981), not that of the keypoint in its centre. Both differ by what the plane of
the surface and the motion say, to first order. On the edge of a surface in front of another one,
the window moves as the surface in front does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.camera import Camera

_EDGE_SIGMA = 0.25  # chosen: of the step between two surfaces, of a keypoint on the edge of one
_MAX_STRETCH = 1.0  # chosen: windows that are stretched by more are left as they are
_SMALLEST = 1e-6  # of a determinant; keeps a window without gradient finite


@dataclass(frozen=True, eq=False)
class Windows:
    """
    What the windows around the keypoints of a frame show.

    :param points: Nx3 float64, what is in their centres [m]: on the edge of a surface in front of
        another one, a point of that surface.
    :param sigmas: N float64, standard deviations of the inverse depths of the points [1/m].
    :param normals: Nx3 float64, planes through the points: n with n . p = 1 [1/m].
    :param moments: Nx3x3 float64, sums over the window: products uu, uv and vv of the gradients,
        as they are, times the offset along u [px], and times that along v [px]; the latter two
        are 0 on an edge.
    """

    points: np.ndarray
    sigmas: np.ndarray
    normals: np.ndarray
    moments: np.ndarray

    @classmethod
    def of(cls, prepared: PreparedFrame, chosen: np.ndarray, side: int) -> Windows:
        """
        Measure the windows around some keypoints of a frame.

        :param chosen: indices of the keypoints, N.
        :param side: of a window [px]; in a smaller image they are as large as it allows.
        """
        frame, keypoints = prepared.corrected, prepared.keypoints
        side = min(side, *(length - 2 for length in frame.depth.shape))
        pixels, points = keypoints.pixels[chosen], keypoints.positions[chosen].astype(np.float64)
        z = points[:, 2].copy()
        sigmas = np.sqrt(keypoints.covariances[chosen, 2, 2].astype(np.float64)) / z ** 2
        edges = depth.edges_beside(frame.depth, pixels, z, side // 2)
        behind = np.flatnonzero(np.isfinite(edges.nearer))
        far, near = z[behind], edges.nearer[behind]
        sigmas[behind] = np.hypot(sigmas[behind], _EDGE_SIGMA * (1 / near - 1 / far))
        points[behind] *= (near / far)[:, None]
        moments = gradient_moments(prepared.grey, pixels, side)
        moments[edges.any, 1:] = 0.0
        return cls(points, sigmas, planes(frame.depth, pixels, points, frame.camera, side),
                   moments)

    def __getitem__(self, chosen: np.ndarray) -> Windows:
        """Return some of the windows, by their indices or by a mask."""
        return Windows(self.points[chosen], self.sigmas[chosen], self.normals[chosen],
                       self.moments[chosen])

    def shifts(self, camera: Camera, T_target_source: np.ndarray,
               turns: np.ndarray) -> np.ndarray:
        """
        Return where the windows are found, beside where the points are, Nx2 [px].

        :param T_target_source: 4x4 [m].
        :param turns: Nx2x2 float64, how the windows are turned before they are tracked [px/px].
        """
        moved = jacobians(self.normals, self.points, camera, T_target_source)
        shifts = np.empty((len(self.points), 2))
        kernels.window_shifts(moved, turns, self.moments, _MAX_STRETCH, _SMALLEST, shifts)
        return shifts


def planes(depth_image: np.ndarray, pixels: np.ndarray, points: np.ndarray, camera: Camera,
           side: int) -> np.ndarray:
    """
    Return the planes of what windows show, through their centres, Nx3: n with n . p = 1 [1/m].

    The slope is that of the inverse depths in the window. Lens distortion is ignored: over so few
    pixels it changes a slope by a few percent.

    :param depth_image: HxW float32 [m], NaN where invalid; such pixels count as as far as the
        centre.
    :param pixels: Nx2, the centres.
    :param points: Nx3, what they show [m].
    :param side: of a window [px].
    """
    slopes = np.empty((len(points), 2))
    kernels.inverse_depth_slopes(
        np.ascontiguousarray(depth_image), np.ascontiguousarray(pixels, np.float64),
        np.ascontiguousarray(points[:, 2]), side, slopes)
    found = np.empty((len(points), 3))
    found[:, :2] = slopes * (camera.fx, camera.fy)
    found[:, 2] = (1.0 - points[:, 0] * found[:, 0] - points[:, 1] * found[:, 1]) / points[:, 2]
    return found


def jacobians(normals: np.ndarray, points: np.ndarray, camera: Camera,
              T_target_source: np.ndarray) -> np.ndarray:
    """
    Return the derivatives of where planes are seen after a motion, Nx2x2 [px/px].

    They are by the pixel before it; lens distortion is ignored.

    :param normals: of :func:`planes`.
    :param points: Nx3 [m].
    :param T_target_source: 4x4 [m].
    """
    found = np.empty((len(points), 2, 2))
    kernels.plane_jacobians(normals, points, np.ascontiguousarray(T_target_source, np.float64),
                            camera.fx / camera.fy, found)
    return found


def gradient_moments(grey: np.ndarray, pixels: np.ndarray, side: int) -> np.ndarray:
    """
    Return the sums of :attr:`Windows.moments`, Nx3x3.

    :param grey: HxW uint8.
    :param pixels: Nx2, the centres.
    :param side: of a window [px].
    """
    moments = np.empty((len(pixels), 3, 3))
    kernels.gradient_moments(np.ascontiguousarray(grey), np.ascontiguousarray(pixels, np.float64),
                             side, moments)
    return moments
