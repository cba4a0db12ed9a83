# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Objects made of boxes, cylinders, balls and panels, each in the frame of its owner."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.surfaces import Disc, Rectangle, Round, Surface

Material = Callable[[np.random.Generator, float, float], np.ndarray]
"""Makes the texture, HxWx3 uint8, of a surface of a given width and height [m]."""

_FACES = {
    'front': ((1, 0, 0), (0, 0, -1)),
    'back': ((-1, 0, 0), (0, 0, -1)),
    'left': ((0, -1, 0), (0, 0, -1)),
    'right': ((0, 1, 0), (0, 0, -1)),
    'top': ((1, 0, 0), (0, -1, 0)),
    'bottom': ((1, 0, 0), (0, 1, 0)),
}
"""Face of a box -> its right and its down direction, seen from outside."""

_VISIBLE = ('front', 'left', 'right', 'top')
_OVERLAP = 0.02  # [m]


@dataclass(frozen=True, eq=False)
class Block:
    """
    A box that neither a camera nor light can pass.

    :param T_world_block: pose of its centre.
    :param size: extent along its axes [m].
    """

    T_world_block: np.ndarray
    size: np.ndarray

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of Nx3 points in the world [m], negative inside."""
        beyond = np.abs(se3.transform(se3.inverse(self.T_world_block), points))
        beyond -= (self.size / 2).astype(points.dtype)
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        distance: np.ndarray = outside + np.minimum(beyond.max(axis=1), 0)
        return distance


class Assembly:
    """
    Collects surfaces and blocks.

    Seen from the front of an object, x is to the right, y away and z up; its position is that of
    the centre of its bottom.

    :param rng: for the textures.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.surfaces: list[Surface] = []
        self.glowing: list[Surface] = []
        self.blocks: list[Block] = []
        self._T_world_here = np.eye(4)

    def at(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0) -> Assembly:
        """Return the same assembly seen from another place, turned about z [rad]."""
        there = copy.copy(self)  # the lists are shared
        there._T_world_here = self._T_world_here @ _pose((x, y, z), turn)
        return there

    def tilted(self, turn: float) -> Assembly:
        """Return the same assembly, tilted backwards about x [rad]."""
        there = self.at()
        there._T_world_here[:3, :3] = (self._T_world_here[:3, :3]
                                       @ se3.exp_rotation((-turn, 0, 0)))
        return there

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Return points given here, Nx3, in the world."""
        return se3.transform(self._T_world_here, points)

    def box(self, size: Sequence[float] | np.ndarray, material: Material,
            faces: Mapping[str, Material] | None = None, open_faces: tuple[str, ...] = (),
            ) -> None:
        """
        Add a box.

        :param size: along x, y and z [m].
        :param material: of its front, left, right and top.
        :param faces: other materials of faces; 'back' and 'bottom' exist only if named here.
        :param open_faces: faces to omit.
        """
        extent = np.asarray(size, float)
        self._add_block(extent)
        materials = {**dict.fromkeys(_VISIBLE, material), **(faces or {})}
        for face, own in materials.items():
            if face not in open_faces:
                self._add_face(extent, face, own)

    def room(self, size: Sequence[float] | np.ndarray, walls: Sequence[Material],
             floor: Material, ceiling: Material) -> None:
        """
        Add a box seen from inside.

        :param walls: those at positive y, positive x, negative y and negative x.
        """
        faces = zip(('front', 'left', 'back', 'right', 'top', 'bottom'),
                    (*walls, floor, ceiling))
        for face, material in faces:
            self._add_face(np.asarray(size, float), face, material, inside=True)

    def panel(self, width: float, height: float, material: Material, glows: bool = False,
              shape: type[Rectangle] = Rectangle) -> None:
        """Add an upright picture, seen from the front; one that glows needs no light."""
        rotation = _rotation('front')
        self._add(shape, rotation, rotation @ (-width / 2, -height, 0), width, height, material,
                  self.glowing if glows else self.surfaces)

    def sheet(self, width: float, height: float, material: Material,
              shape: type[Rectangle] = Rectangle) -> None:
        """Add a picture that lies, seen from above; (0, 0) is its centre."""
        rotation = _rotation('top')
        self._add(shape, rotation, rotation @ (-width / 2, -height / 2, 0), width, height,
                  material, self.surfaces)

    def lamp(self, width: float, height: float, material: Material) -> None:
        """Add a glowing sheet seen from below; (0, 0) is its centre."""
        rotation = _rotation('bottom')
        self._add(Rectangle, rotation, rotation @ (-width / 2, -height / 2, 0), width, height,
                  material, self.glowing)

    def cone(self, bottom_radius: float, top_radius: float, height: float, material: Material,
             top: Material | None = None) -> None:
        """Add a cylinder or a part of a cone, with a lid where it has a material."""
        slope = (top_radius - bottom_radius) / height
        profile = bottom_radius ** 2, 2 * bottom_radius * slope, slope ** 2
        self._add_round(profile, 0.0, height, material)
        if top is not None:
            self.at(z=height).sheet(2 * top_radius, 2 * top_radius, top, Disc)

    def ball(self, radius: float, material: Material) -> None:
        """Add a sphere that lies on z = 0."""
        self.at(z=radius)._add_round((radius ** 2, 0.0, -1.0), -radius, radius, material)

    def _add_round(self, profile: tuple[float, float, float], low: float, high: float,
                   material: Material) -> None:
        blank = Round(self._T_world_here, profile, low, high, np.zeros((1, 1, 3), np.uint8))
        image = material(self.rng, blank.width, blank.height)
        self.surfaces.append(Round(self._T_world_here, profile, low, high, image))
        across = blank.width / np.pi
        self.at(z=low)._add_block(np.array([across, across, high - low]))

    def _add_block(self, size: np.ndarray) -> None:
        self.blocks.append(Block(self._T_world_here @ _pose((0, 0, size[2] / 2)), size))

    def _add_face(self, size: np.ndarray, face: str, material: Material,
                  inside: bool = False) -> None:
        rotation = _rotation(face)
        width, height, depth = np.abs(rotation.T @ size)
        if inside:
            # extended into the adjacent walls, so that there is no gap
            width, height, depth = width + _OVERLAP, height + _OVERLAP, -depth
        corner = np.array([-width, -height, -depth]) / 2
        self._add(Rectangle, rotation, rotation @ corner + (0, 0, size[2] / 2), width, height,
                  material, self.surfaces)

    def _add(self, shape: type[Rectangle], rotation: np.ndarray, corner: np.ndarray,
             width: float, height: float, material: Material, where: list[Surface]) -> None:
        T_here_surface = np.eye(4)
        T_here_surface[:3, :3], T_here_surface[:3, 3] = rotation, corner
        where.append(shape(self._T_world_here @ T_here_surface, float(width), float(height),
                           material(self.rng, width, height)))


def _pose(position: tuple[float, float, float], turn: float = 0.0) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = se3.exp_rotation((0, 0, turn)), position
    return pose


def _rotation(face: str) -> np.ndarray:
    right, down = _FACES[face]
    return np.column_stack([right, down, np.cross(right, down)]).astype(float)
