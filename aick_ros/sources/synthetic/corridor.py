# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A corridor along a row of bookshelves, and somebody who walks through it with a camera."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.sources.synthetic import furniture, materials
from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.lighting import Lamp
from aick_ros.sources.synthetic.path import attitude
from aick_ros.sources.synthetic.scene import Scene, Zone
from aick_ros.sources.synthetic.wander import Wander

_WIDTH, _HEIGHT = 2.6, 2.5  # [m]
_SHELF = 1.0  # wide [m]
_LAMPS_APART = 3.0  # [m]
_LAMPS_REACH = 10.0  # [m]; the floor there gets less than a two-thousandth of the light of a lamp
_WOOD, _WALL, _FLOOR = (168, 128, 88), (222, 216, 204), (128, 98, 72)

_EYE = 1.35  # above the floor [m]
_MARGIN = 1.2  # [m] from the ends of the corridor to those of the walk
_HEADING = np.radians(62.0)  # from along the corridor towards the shelves
_PITCH = np.radians(-8.0)
_SWAY = ((0.6, 0.15, 0.3), (0.4, 0.5, 0.9))
_STEPS = ((0.5, 0.9, 1.1), (0.5, 1.8, 2.2))


def corridor(seed: int, length: float) -> Scene:
    """Return a corridor along x with shelves on its left, of a length in metres."""
    rng = np.random.default_rng([seed, 0])
    hall = Assembly(rng)
    size = np.array([length, _WIDTH, _HEIGHT])
    wall = materials.plaster(_WALL)
    hall.room(size, [wall] * 4, materials.planks(_FLOOR), wall)
    for place in np.arange(_SHELF / 2, length, _SHELF) - length / 2:
        furniture.bookshelf(hall.at(place, _WIDTH / 2), _SHELF, 2.0, _WOOD)
    lamps = []
    for place in np.arange(_LAMPS_APART / 2, length, _LAMPS_APART) - length / 2:
        hall.at(place, z=_HEIGHT - 0.03).lamp(1.2, 0.3, materials.plain((252, 250, 240), 0.01))
        lamps.append(Lamp(np.array([[place, 0, _HEIGHT - 0.05]]), np.array([0, 0, -1.0]),
                          np.array([2.2, 2.1, 2.0]), _LAMPS_REACH))
    half = size * (0.5, 0.5, 1)
    interior = Zone(half * (-1, -1, 0), half)
    free = Zone(np.array([-half[0] + _MARGIN, -0.3, 1.2]), np.array([half[0] - _MARGIN, 0.3, 1.6]))
    return Scene.assemble(hall, lamps, interior, free)


class WalkingPath:
    """
    A walk from one end of a corridor to the other, looking at the shelves.

    :param duration: of the walk [s].
    """

    def __init__(self, rng: np.random.Generator, zone: Zone, duration: float) -> None:
        self._zone, self._duration = zone, duration
        self._sway = [Wander(rng, amplitude, _SWAY) for amplitude in (0.05, 0.05, 0.02)]
        self._bob = [Wander(rng, amplitude, _STEPS) for amplitude in (0.004, 0.004, 0.006)]
        self._look = [Wander(rng, np.radians(degrees), _SWAY) for degrees in (12.0, 5.0, 3.0)]
        self._shake = [Wander(rng, np.radians(0.4), _STEPS) for _ in range(3)]

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` of the optical frame at a time [s]."""
        low, high = self._zone.low, self._zone.high
        yaw, pitch, roll = (wander.at(time) for wander in self._look)
        pose = np.eye(4)
        pose[:3, :3] = attitude(_HEADING + yaw, _PITCH + pitch, roll) @ se3.exp_rotation(
            [wander.at(time) for wander in self._shake])
        pose[:3, 3] = [low[0] + (high[0] - low[0]) * time / self._duration, -0.15, _EYE]
        pose[:3, 3] += [sway.at(time) + bob.at(time) for sway, bob in zip(self._sway, self._bob)]
        return pose
