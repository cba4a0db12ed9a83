# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rendered rooms in which places look alike, and a camera that returns to where it was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic import furniture, materials, prints
from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.lighting import Lamp
from aick_ros.sources.synthetic.path import attitude
from aick_ros.sources.synthetic.scene import Scene, Zone
from aick_ros.sources.synthetic.wander import Wander

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
SLOW = ((0.6, 0.08, 0.15), (0.3, 0.2, 0.35), (0.1, 0.4, 0.7))
"""Shares of the amplitude and frequencies [Hz] of a movement that returns."""

_SIZE = np.array([6.0, 3.4, 2.6])  # of a room [m]
_WOOD, _WALL, _FLOOR = (112, 74, 48), (222, 212, 190), (150, 106, 66)
_CLUTTER = (furniture.vase, furniture.radio, furniture.photograph)

Piece = Callable[[Assembly, float], None]


class Returning:
    """A camera that is moved to and fro about the middle of a zone."""

    def __init__(self, rng: np.random.Generator, zone: Zone, reach: float, degrees: float,
                 heading: float = np.pi / 2) -> None:
        self._centre, self._heading = zone.centre, heading
        self._position = [Wander(rng, reach * share, SLOW) for share in (1.0, 1.0, 0.7)]
        self._attitude = [Wander(rng, np.radians(degrees) * share, SLOW)
                          for share in (1.0, 0.7, 1.0)]

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` of the optical frame at a time [s]."""
        yaw, pitch, roll = (wander.at(time) for wander in self._attitude)
        pose = np.eye(4)
        pose[:3, :3] = attitude(self._heading + yaw, np.radians(-15) + pitch, roll)
        pose[:3, 3] = self._centre + [wander.at(time) for wander in self._position]
        return pose


def equal_shelves(seed: int) -> Scene:
    """Return a room along whose long walls the same bookshelf stands every half a metre."""
    room, wall = Assembly(np.random.default_rng([seed, 0])), materials.plaster(_WALL)
    room.room(tuple(_SIZE), [wall] * 4, materials.planks(_FLOOR), wall)
    for quarter in (0, 2):
        _put_row(room.at(turn=quarter * np.pi / 2), seed, _bookshelf, 0.5, 2.75)
    return _lit(room)


def lookalike_room(seed: int) -> Scene:
    """
    Return a room along one of whose walls a piece of furniture is repeated.

    The seed selects the piece, its spacing, and whether walls and floor have a texture by which
    places could be told apart.
    """
    rng = np.random.default_rng([seed, 2])
    wall, floor = materials.plain(_WALL), materials.plain(_FLOOR)
    if rng.integers(2):
        wall, floor = materials.plaster(_WALL), materials.planks(_FLOOR)
    room = Assembly(np.random.default_rng([seed, 0]))
    room.room(tuple(_SIZE), [wall] * 4, floor, wall)
    piece = list(PIECES.values())[seed % len(PIECES)]
    _put_row(room, seed, piece, rng.uniform(0.4, 0.75), 2.2)
    return _lit(room)


def _put_row(wall: Assembly, seed: int, piece: Piece, spacing: float, reach: float) -> None:
    """Repeat a piece of furniture along a wall, so far from its middle [m]."""
    for place in np.arange(spacing / 2 - reach, reach, spacing):
        here = wall.at(place, _SIZE[1] / 2)
        here.rng = np.random.default_rng([seed, 7])
        piece(here, spacing)


def _lit(room: Assembly) -> Scene:
    """Return a furnished room with its lamps."""
    lamps = [Lamp(np.array([[x, 0.0, 2.5]]), np.array([0.0, 0.0, -1.0]), np.full(3, 3.0))
             for x in (-1.5, 1.5)]
    half = _SIZE * (0.5, 0.5, 1.0)
    return Scene.assemble(room, lamps, Zone(half * (-1, -1, 0), half),
                          Zone(np.array([-1.0, -0.5, 1.05]), np.array([1.0, 0.5, 1.55])))


def _bookshelf(here: Assembly, width: float) -> None:
    furniture.bookshelf(here, width, 2.2, _WOOD)


def _cabinet(here: Assembly, width: float) -> None:
    furniture.cabinet(here, width, _WOOD, _CLUTTER[:2])
    furniture.picture(here.at(z=1.25), 0.6 * width, 0.5, prints.poster)


def _cartons(here: Assembly, width: float) -> None:
    furniture.cartons(here.at(0.0, -0.3))
    furniture.picture(here.at(z=1.1), 0.7 * width, 0.7, prints.poster)


def _picture(here: Assembly, width: float) -> None:
    for height in (0.4, 1.05, 1.7):
        furniture.picture(here.at(z=height), 0.8 * width, 0.5, prints.poster)


PIECES: dict[str, Piece] = {
    'bookshelves': _bookshelf, 'cabinets': _cabinet, 'boxes': _cartons, 'pictures': _picture}
"""Furniture of :func:`lookalike_room`, by the remainder of its seed."""
