# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What the windows around keypoints show, and how a motion displaces it.

A window is tracked as if it moved as a whole. Where its pixels are not equally far away they do
not: what is found is the mean of their displacements, weighted by their gradients (Lucas and
Kanade 1981), not that of the keypoint in its centre. Both differ by what the depths in the window
and the motion say, to first order. An edge of a surface moves with that surface, and not with what
is seen behind it. A window beside the edge of a surface far in front of another one, as on the
pattern of a carpet which a table hides in part, moves with both in the mean, as much of its
gradients is on each, but often more with the one or the other.

A motion also turns and stretches a window. It is warped before it is sought, as the plane through
the surface in its centre is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

_SURE_SIGMA, _UNSURE_VARIANCE = 0.1, 0.6
"""Scatter of the place between two surfaces that a window moves with, in steps between them: the
standard deviation where all gradients are on one, and what their mean place m adds to the
variance, by m (1 - m).

Measured on rendered rooms and corridors; on two excerpts of real recordings it is larger still."""

_STEP = 8.0  # chosen: standard deviations of the inverse depth, of a step between two surfaces
_RIDGE = 0.05  # chosen: weight of slopes of zero, beside that of depth in a whole window
_LEAST_WARP = 0.02
"""Change of a derivative [px/px] up to which a window is not warped.

Chosen: to sample a warped one takes longer, and the shift corrects small changes."""

_MAX_STRETCH = 1.0  # chosen: windows that are stretched by more are left as they are
_SMALLEST = 1e-6  # of a determinant; keeps a window without gradient finite


@dataclass(frozen=True, eq=False)
class Windows:
    """
    What the windows around the keypoints of a frame show.

    :param points: Nx3 float64, what is in their centres [m]; beside the edge of a surface in front
        of another one, a point between them, that moves as the window does.
    :param sigmas: N float64, standard deviations of the inverse depths of the points [1/m].
    :param moments: Nx3x3 float64, sums over the window: products uu, uv and vv of the gradients,
        as they are, times the offset along u [px], and times that along v [px].
    :param reliefs: Nx3 float64, the same products times how much nearer than the point is what
        they are on [1/m].
    :param slopes: Nx2 float64, change of the inverse depth of the surface that the point is on,
        along u and v [1/m px].
    """

    points: np.ndarray
    sigmas: np.ndarray
    moments: np.ndarray
    reliefs: np.ndarray
    slopes: np.ndarray

    @classmethod
    def of(cls, prepared: PreparedFrame, chosen: np.ndarray, side: int,
           sensor: SensorSettings) -> Windows:
        """
        Measure the windows around some keypoints of a frame.

        :param chosen: indices of the keypoints, N.
        :param side: of a window [px]; in a smaller image they are as large as it allows.
        """
        frame, keypoints = prepared.frame, prepared.keypoints
        side = min(side, *(length - 2 for length in frame.depth.shape))
        pixels, points = keypoints.pixels[chosen], keypoints.positions[chosen].astype(np.float64)
        z = points[:, 2].copy()
        sigmas = np.sqrt(keypoints.covariances[chosen, 2, 2].astype(np.float64)) / z ** 2
        moments = gradient_moments(prepared.grey, pixels, side)
        energies = np.maximum(_traces(moments[:, 0]), _SMALLEST)
        surfaces = depth.filled(frame.depth)
        of_all, reliefs, slopes = reliefs_of(prepared.grey, surfaces, pixels, z, side, sensor)
        # beside an edge: between what is in the centre and the nearer surface
        nearer = depth.nearer_beside(frame.depth, pixels, z, side // 2)
        is_behind = np.isfinite(nearer)
        steps = np.where(is_behind, 1 / nearer - 1 / z, 0.0)
        places = np.clip(np.divide(_traces(of_all) / energies, steps, np.zeros(len(z)),
                                   where=is_behind), 0.0, 1.0)
        sigmas = np.hypot(sigmas, steps * np.sqrt(
            _SURE_SIGMA ** 2 + _UNSURE_VARIANCE * places * (1.0 - places)))
        points /= (1.0 + places * steps * z)[:, None]
        in_front, = np.nonzero(places > 0.5)
        _, reliefs[in_front], slopes[in_front] = reliefs_of(
            prepared.grey, surfaces, pixels[in_front], nearer[in_front], side, sensor)
        return cls(points, sigmas, moments, reliefs, slopes)

    def __getitem__(self, chosen: np.ndarray) -> Windows:
        """Return some of the windows, by their indices."""
        return Windows(self.points.take(chosen, axis=0), self.sigmas.take(chosen),
                       self.moments.take(chosen, axis=0), self.reliefs.take(chosen, axis=0),
                       self.slopes.take(chosen, axis=0))

    def warps(self, camera: Camera, T_target_source: np.ndarray) -> np.ndarray:
        """
        Return how a motion turns and stretches the windows, Nx2x2 [px/px].

        It is as :func:`warps_of` returns it, and the identity where it is near that.

        :param T_target_source: 4x4 [m].
        """
        return warps_of(self.points, self.slopes, camera, T_target_source, _LEAST_WARP)

    def shifts(self, camera: Camera, T_target_source: np.ndarray,
               warps: np.ndarray) -> np.ndarray:
        """
        Return where the windows are found, beside where the points are, Nx2 [px].

        Lens distortion is ignored: over so few pixels it changes a displacement by a few percent.

        :param T_target_source: 4x4 [m].
        :param warps: Nx2x2 float64, how the windows are warped before they are tracked [px/px].
        """
        shifts = np.empty((len(self.points), 2))
        kernels.window_shifts(
            self.points, T_target_source, camera.fx, camera.fy, warps, self.moments, self.reliefs,
            _MAX_STRETCH, _SMALLEST, shifts)
        return shifts


def warps_of(points: np.ndarray, slopes: np.ndarray, camera: Camera,
             T_target_source: np.ndarray, least: float = 0.0) -> np.ndarray:
    """
    Return the derivatives of where planes are seen after a motion, Nx2x2 [px/px].

    They are by the pixel before it; lens distortion is ignored.

    :param points: Nx3, of the planes [m].
    :param slopes: Nx2, of their inverse depths, along u and v [1/m px].
    :param T_target_source: 4x4 [m].
    :param least: the identity is returned where no derivative differs from it by as much.
    """
    warps = np.empty((len(points), 2, 2))
    kernels.window_warps(points, T_target_source, camera.fx, camera.fy, slopes, least, warps)
    return warps


def gradient_moments(grey: np.ndarray, pixels: np.ndarray, side: int) -> np.ndarray:
    """
    Return the sums of :attr:`Windows.moments`, Nx3x3.

    :param grey: HxW uint8.
    :param pixels: Nx2, the centres.
    :param side: of a window [px].
    """
    moments = np.empty((len(pixels), 3, 3))
    kernels.gradient_moments(grey, pixels, side, moments)
    return moments


def reliefs_of(grey: np.ndarray, depth_image: np.ndarray, pixels: np.ndarray, depths: np.ndarray,
               side: int, sensor: SensorSettings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return what the depths in windows show.

    A gradient is measured between the neighbours of a pixel. Where there is a step between two
    surfaces, it is on the nearer one. Pixels without depth count as as far as the centre.

    :param grey: HxW uint8.
    :param depth_image: HxW float32 [m], NaN where invalid.
    :param pixels: Nx2, the centres.
    :param depths: N, of the surfaces there [m].
    :param side: of a window [px].
    :returns: the sums of :attr:`Windows.reliefs` of all surfaces, Nx3; those sums, for which other
        surfaces, far in front or behind, count as as far as the centre too, Nx3; and the
        slopes of the plane that fits the surface in the centre best, Nx2, 0 without depth.
    """
    count = len(pixels)
    of_all, reliefs, slopes = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 2))
    ridge = _RIDGE * side ** 2 * (side ** 2 - 1) / 12  # of the squared offsets of all pixels
    kernels.window_reliefs(
        grey, depth_image, pixels, depths, side, depth.noise(sensor, _STEP), depth.LEAST_RISE,
        ridge, of_all, reliefs, slopes)
    return of_all, reliefs, slopes


def _traces(products: np.ndarray) -> np.ndarray:
    """Return the sums of squares along u and v, N, of products uu, uv and vv, Nx3."""
    traces: np.ndarray = products[:, 0] + products[:, 2]
    return traces
