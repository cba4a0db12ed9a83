# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Surfaces of a scene: textured rectangles, discs, cylinders, cones and spheres.

A ray is given by its coordinates (x, y) on the plane z = 1 of the camera. A hit is given by its
inverse depth, because on a plane this is linear in x and y; 0 stands for no hit. A surface has
coordinates (s, t) in metres, from the top left of its image to the right and down.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np


class TexturePoints(NamedTuple):
    """
    The points of a surface that rays hit; all arrays of one shape.

    :param s: along the image's rows [m].
    :param t: along the image's columns [m].
    :param stretch_s: how much more than its width a pixel covers at oblique incidence, as a vector
        on the surface [m]; stretch_t likewise.
    """

    s: np.ndarray
    t: np.ndarray
    stretch_s: np.ndarray
    stretch_t: np.ndarray


class Surface(Protocol):
    """A piece of surface with a texture."""

    @property
    def T_world_surface(self) -> np.ndarray:
        """Pose, 4x4."""

    @property
    def width(self) -> float:
        """Width of the image [m]."""

    @property
    def height(self) -> float:
        """Height of the image [m]."""

    @property
    def image(self) -> np.ndarray:
        """Texture, HxWx3 uint8."""

    @property
    def one_sided(self) -> bool:
        """A surface that is visible from negative z only."""

    @property
    def hull(self) -> np.ndarray:
        """Points in the world whose convex hull contains the surface, Kx3 [m]."""

    def inverse_depth(self, T_surface_camera: np.ndarray, x: np.ndarray,
                      y: np.ndarray) -> np.ndarray:
        """Return the inverse depth [1/m] at which rays hit, 0 where they do not; broadcasts."""

    def texture_points(self, T_surface_camera: np.ndarray, x: np.ndarray, y: np.ndarray,
                       inverse_depth: np.ndarray, pixel_size: float) -> TexturePoints:
        """Return where hits lie; ``pixel_size`` is that of a pixel on the plane z = 1."""

    def points(self, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points of the surface in the world and the normals there, both Nx3."""

    def with_image(self, image: np.ndarray) -> Surface:
        """Return the same surface with another texture, HxWx3 uint8."""


@dataclass(frozen=True, eq=False)
class Rectangle:
    """
    A rectangle seen from one side.

    The surface frame has its origin in the top left corner, x to the right, y down and z away
    from the visible side.
    """

    T_world_surface: np.ndarray
    width: float
    height: float
    image: np.ndarray
    one_sided = True

    @property
    def hull(self) -> np.ndarray:
        """The four corners, 4x3 [m]."""
        s = np.array([0.0, self.width, self.width, 0.0])
        t = np.array([0.0, 0.0, self.height, self.height])
        return self.points(s, t)[0]

    def inverse_depth(self, T_surface_camera: np.ndarray, x: np.ndarray,
                      y: np.ndarray) -> np.ndarray:
        """Return the inverse depth [1/m] at which rays hit, 0 where they do not; broadcasts."""
        depth, right, down = _plane_coefficients(T_surface_camera)
        inside = (_not_negative(depth, x, y) & _not_negative(right, x, y)
                  & _not_negative(self.width * depth - right, x, y)
                  & _not_negative(down, x, y)
                  & _not_negative(self.height * depth - down, x, y))
        inverse_depth: np.ndarray = _linear(depth, x, y) * inside
        return inverse_depth

    def texture_points(self, T_surface_camera: np.ndarray, x: np.ndarray, y: np.ndarray,
                       inverse_depth: np.ndarray, pixel_size: float) -> TexturePoints:
        """Return where hits lie; ``pixel_size`` is that of a pixel on the plane z = 1."""
        _, right, down = _plane_coefficients(T_surface_camera).astype(np.float32)
        axes = T_surface_camera[:2, :3].astype(np.float32)
        z = 1 / inverse_depth
        # a pixel is z * pixel_size wide and, at an incidence theta, longer by its tan(theta)
        stretch = z * z * np.float32(-pixel_size / T_surface_camera[2, 3])
        return TexturePoints(_linear(right, x, y) * z, _linear(down, x, y) * z,
                             _linear(axes[0], x, y) * stretch, _linear(axes[1], x, y) * stretch)

    def points(self, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points of the surface in the world and the normals there, both Nx3."""
        right, down, away, origin = self.T_world_surface[:3].T
        points = origin + s[:, None] * right + t[:, None] * down
        return points, np.broadcast_to(-away, points.shape)

    def with_image(self, image: np.ndarray) -> Rectangle:
        """Return the same surface with another texture, HxWx3 uint8."""
        return dataclasses.replace(self, image=image)


class Disc(Rectangle):
    """The disc within a square."""

    def inverse_depth(self, T_surface_camera: np.ndarray, x: np.ndarray,
                      y: np.ndarray) -> np.ndarray:
        """Return the inverse depth [1/m] at which rays hit, 0 where they do not; broadcasts."""
        inverse_depth = super().inverse_depth(T_surface_camera, x, y)
        _, right, down = _plane_coefficients(T_surface_camera)
        radius = self.width / 2
        from_centre = np.square(_linear(right, x, y) - radius * inverse_depth)
        from_centre += np.square(_linear(down, x, y) - radius * inverse_depth)
        inside: np.ndarray = from_centre <= np.square(radius * inverse_depth)
        within: np.ndarray = inverse_depth * inside
        return within


@dataclass(frozen=True, eq=False)
class Round:
    """
    A surface of revolution of second order about the z axis of its frame, seen from outside.

    In this frame x^2 + y^2 = a + b z + c z^2, from z = ``low`` to z = ``high``. The image is wound
    around it, starting at the x axis; ``width`` is its largest circumference.

    :param profile: (a, b, c).
    """

    T_world_surface: np.ndarray
    profile: tuple[float, float, float]
    low: float
    high: float
    image: np.ndarray
    one_sided = False

    @property
    def width(self) -> float:
        """The largest circumference [m]."""
        return 2 * np.pi * self._largest_radius

    @property
    def height(self) -> float:
        """The extent along the axis [m]."""
        return self.high - self.low

    @property
    def hull(self) -> np.ndarray:
        """The corners of the box around it, 8x3 [m]."""
        radius = self._largest_radius
        corners = np.array([[x, y, z] for x in (-radius, radius) for y in (-radius, radius)
                            for z in (self.low, self.high)])
        hull: np.ndarray = (corners @ self.T_world_surface[:3, :3].T
                            + self.T_world_surface[:3, 3])
        return hull

    def inverse_depth(self, T_surface_camera: np.ndarray, x: np.ndarray,
                      y: np.ndarray) -> np.ndarray:
        """Return the inverse depth [1/m] at which rays hit, 0 where they do not; broadcasts."""
        # the ray (x, y, 1, w), in homogeneous coordinates, gives q_dd + 2 q_do w + q_oo w^2 = 0
        q = T_surface_camera.T @ self._quadric @ T_surface_camera
        q_dd = ((q[0, 0] * x + (2 * q[0, 1] * y + 2 * q[0, 2])) * x
                + ((q[1, 1] * y + 2 * q[1, 2]) * y + q[2, 2]))
        q_do = _linear(q[3, :3], x, y)
        discriminant = q_do * q_do - q_dd * q[3, 3]
        # of the two roots this is the one at which a ray enters
        inverse_depth: np.ndarray = (np.sqrt(np.maximum(discriminant, 0)) - q_do) / q[3, 3]
        axis, origin = T_surface_camera[2, :3], T_surface_camera[2, 3]
        along = _linear(axis, x, y) + origin * inverse_depth
        hit = ((discriminant > 0) & (inverse_depth > 0) & (along >= self.low * inverse_depth)
               & (along <= self.high * inverse_depth))
        seen: np.ndarray = inverse_depth * hit
        return seen

    def texture_points(self, T_surface_camera: np.ndarray, x: np.ndarray, y: np.ndarray,
                       inverse_depth: np.ndarray, pixel_size: float) -> TexturePoints:
        """Return where hits lie; the stretch is neglected, round things are small."""
        depth = 1 / inverse_depth
        right, forward, up = (_linear(axis[:3], x, y) * depth + axis[3]
                              for axis in T_surface_camera[:3].astype(np.float32))
        turn = np.arctan2(forward, right) / np.float32(2 * np.pi)
        zeros = np.zeros_like(turn)
        return TexturePoints((turn - np.floor(turn)) * np.float32(self.width),
                             np.float32(self.high) - up, zeros, zeros)

    def points(self, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points of the surface in the world and the normals there, both Nx3."""
        angle, z = 2 * np.pi * s / self.width, self.high - t
        a, b, c = self.profile
        radius = np.sqrt(np.maximum(a + b * z + c * z * z, 0))
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
        normals = points * (1, 1, -c) - (0, 0, b / 2)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        rotation = self.T_world_surface[:3, :3].T
        return points @ rotation + self.T_world_surface[:3, 3], normals @ rotation

    def with_image(self, image: np.ndarray) -> Round:
        """Return the same surface with another texture, HxWx3 uint8."""
        return dataclasses.replace(self, image=image)

    @property
    def _largest_radius(self) -> float:
        a, b, c = self.profile
        top = [-b / (2 * c)] if c < 0 and self.low < -b / (2 * c) < self.high else []
        return max(float(np.sqrt(max(a + b * z + c * z * z, 0)))
                   for z in [self.low, self.high, *top])

    @property
    def _quadric(self) -> np.ndarray:
        a, b, c = self.profile
        return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -c, -b / 2], [0, 0, -b / 2, -a]])


def _linear(coefficients: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    value: np.ndarray = coefficients[0] * x + (coefficients[1] * y + coefficients[2])
    return value


def _not_negative(coefficients: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return where a linear function is >= 0; on a grid much faster than computing it."""
    result: np.ndarray = coefficients[0] * x >= -(coefficients[1] * y + coefficients[2])
    return result


def _plane_coefficients(T_surface_camera: np.ndarray) -> np.ndarray:
    """
    Return what is linear in (x, y, 1) on the plane z = 0 of a surface, 3x3.

    Its rows: the inverse depth, and s and t times the inverse depth.
    """
    depth = T_surface_camera[2, :3] / -T_surface_camera[2, 3]
    return np.stack([depth, *(T_surface_camera[:2, :3] + T_surface_camera[:2, 3:] * depth)])
