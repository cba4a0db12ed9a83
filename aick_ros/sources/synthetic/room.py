# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A furnished living room, another one for each seed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from aick_ros.sources.synthetic import furniture, materials, prints
from aick_ros.sources.synthetic.assembly import Assembly
from aick_ros.sources.synthetic.lighting import Lamp
from aick_ros.sources.synthetic.scene import Scene, Zone
from aick_ros.sources.synthetic.surfaces import Disc

_WOODS = ((150, 106, 66), (112, 74, 48), (186, 148, 104), (128, 92, 70), (206, 188, 160))
_WALLS = ((222, 212, 190), (206, 214, 204), (200, 210, 220), (226, 206, 190), (214, 208, 216))
_TWIGS = ((110, 130, 100), (160, 100, 84), (96, 112, 144), (150, 120, 70), (120, 90, 120))
_BRICKS = ((164, 92, 70), (176, 120, 88), (190, 176, 160))
_WHITE = (236, 234, 228)
_OUTREACH = 0.95  # [m]; no furniture at a wall reaches farther into the room
_KEEP_OFF = 0.35  # [m] between furniture and where a camera may be


def furnished_room(seed: int) -> Scene:
    """Return the room of a seed."""
    rng = np.random.default_rng([seed, 0])
    size = rng.uniform((4.5, 3.9, 2.5), (5.1, 4.5, 2.7))
    room = Assembly(rng)
    lamps = [_build_shell(room, size)]
    walls = _pick(rng, (_library_wall, _sofa_wall, _cabinet_wall, _window_wall), 4)
    for quarter, furnish in enumerate(walls):
        along, across = (size[0], size[1]) if quarter % 2 == 0 else (size[1], size[0])
        # who stands at the wall looks along its y
        turned = room.at(turn=quarter * np.pi / 2)
        lamps += furnish(turned.at(y=across / 2), along)
    carpet_width, carpet_height = rng.uniform((1.9, 1.3), (2.3, 1.6))
    turned = room.at(turn=rng.uniform(-0.15, 0.15))
    turned.at(z=0.004).sheet(carpet_width, carpet_height, prints.rug)
    furniture.coffee_table(turned.at(*rng.uniform(-0.2, 0.2, 2)), _one(rng, _WOODS))
    furniture.stool(turned.at(rng.choice((-0.8, 0.8)), rng.uniform(-0.3, 0.3)),
                    materials.hue(rng))
    half = size * (0.5, 0.5, 1)
    interior = Zone(half * (-1, -1, 0), half)
    return Scene.assemble(room, lamps, interior, _free(size))


def _build_shell(room: Assembly, size: np.ndarray) -> Lamp:
    """Build walls, floor and ceiling, a little larger than the room so that no gap is left."""
    rng = room.rng
    colour, twigs = _one(rng, _WALLS), tuple(_pick(rng, _TWIGS, 2))
    papered = materials.wallpaper(colour, twigs)
    walls = _pick(
        rng, (papered, papered, materials.brick(_one(rng, _BRICKS)), materials.plaster(colour)), 4)
    room.room(size, walls, materials.planks(_one(rng, _WOODS)), materials.plaster(_WHITE))
    width, depth = 0.9, 0.6
    room.at(z=size[2] - 0.03).lamp(width, depth, materials.plain((252, 250, 240), 0.01))
    x, y = np.meshgrid((-0.3, 0, 0.3), (-0.2, 0.2))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, size[2] - 0.05)])
    return Lamp(points, np.array([0, 0, -1.0]), np.array([4.4, 4.2, 3.9]))


def _library_wall(wall: Assembly, along: float) -> list[Lamp]:
    """Put a bookshelf, a desk and pictures at a wall."""
    rng, side = wall.rng, _side(wall.rng)
    _skirting(wall, along)
    furniture.bookshelf(wall.at(-0.95 * side), 1.0, rng.uniform(1.8, 2.1), _one(rng, _WOODS))
    furniture.desk(wall.at(0.3 * side), _one(rng, _WOODS))
    furniture.picture(wall.at(0.1 * side, z=1.35), 0.5, 0.6, prints.poster)
    furniture.wall_shelf(wall.at(0.78 * side, z=1.4), 0.6, _one(rng, _WOODS))
    furniture.picture(wall.at(1.42 * side, z=0.95), 0.5, 0.7, prints.poster)
    return []


def _sofa_wall(wall: Assembly, along: float) -> list[Lamp]:
    """Put a sofa, a lamp and pictures at a wall."""
    rng, side = wall.rng, _side(wall.rng)
    _skirting(wall, along)
    furniture.sofa(wall, materials.hue(rng, (0.15, 0.5), (0.35, 0.7)))
    for x, width, height in ((-0.75, 0.5, 0.65), (0.05, 0.8, 0.6), (0.8, 0.45, 0.6)):
        furniture.picture(wall.at(x, z=1.15 + rng.uniform(0, 0.1)), width, height, prints.poster)
    furniture.floor_lamp(wall.at(1.22 * side, -0.26))
    furniture.book_pile(wall.at(-1.2 * side, -0.25), 6)
    bulb = wall.to_world(np.array([[1.22 * side, -0.26, 1.3]]))
    return [Lamp(bulb, np.array([0, 0, -1.0]), np.array([0.9, 0.7, 0.45]))]


def _cabinet_wall(wall: Assembly, along: float) -> list[Lamp]:
    """Put a door, a chest of drawers and a shelf at a wall."""
    rng, side = wall.rng, _side(wall.rng)
    _skirting(wall, along)
    wall.at(-0.9 * side, -0.02).panel(0.85, 2.0, prints.door(_one(rng, _WALLS)))
    furniture.cabinet(wall.at(0.75 * side), 1.3, _one(rng, _WOODS),
                      _pick(rng, furniture.CLUTTER, 4))
    furniture.wall_shelf(wall.at(0.5 * side, z=1.5), 0.7, _one(rng, _WOODS))
    furniture.picture(wall.at(1.2 * side, z=1.35), 0.45, 0.6, prints.poster)
    wall.at(-0.2 * side, -0.02, 1.6).panel(0.3, 0.3, prints.clock, shape=Disc)
    return []


def _window_wall(wall: Assembly, along: float) -> list[Lamp]:
    """Put a window, a low bookshelf, a plant and boxes at a wall."""
    side, sill = _side(wall.rng), 0.95
    _skirting(wall, along)
    furniture.window(wall.at(z=sill), 1.4, 1.2)
    furniture.bookshelf(wall.at(0.1 * side), 1.4, 0.8, _one(wall.rng, _WOODS))
    furniture.plant(wall.at(1.18 * side, -0.3))
    furniture.cartons(wall.at(-1.15 * side, -0.28))
    x, z = np.meshgrid((-0.45, 0, 0.45), (sill + 0.3, sill + 0.9))
    points = np.column_stack([x.ravel(), np.full(x.size, -0.25), z.ravel()])
    inwards = wall.to_world(np.array([[0, -1.0, 0]])) - wall.to_world(np.zeros((1, 3)))
    return [Lamp(wall.to_world(points), inwards[0], np.array([2.7, 2.9, 3.2]))]


def _skirting(wall: Assembly, along: float) -> None:
    wall.at(y=-0.012).panel(along, 0.09, materials.plain(_WHITE))


def _free(size: np.ndarray) -> Zone:
    """Return the middle of the room, above the low furniture there."""
    half = size[:2] / 2 - _OUTREACH - _KEEP_OFF
    return Zone(np.array([*-half, 1.05]), np.array([*half, 1.55]))


def _side(rng: np.random.Generator) -> int:
    return int(rng.choice((-1, 1)))


def _one(rng: np.random.Generator, choices: Sequence[Any]) -> Any:
    return choices[int(rng.integers(len(choices)))]


def _pick(rng: np.random.Generator, choices: Sequence[Any], count: int) -> list[Any]:
    return [choices[int(i)] for i in rng.permutation(len(choices))[:count]]
