# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Pieces of furniture.

Each is put together at the place that it is given: x to the right, the front towards negative y,
the middle of its back at (0, 0, 0) for what stands at a wall, of its bottom for the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from aick_ros.sources.synthetic import materials, prints
from aick_ros.sources.synthetic.assembly import Assembly, Material
from aick_ros.sources.synthetic.materials import Colour, hue, scaled
from aick_ros.sources.synthetic.surfaces import Disc

_DARK = (52, 48, 46)
_METAL = (150, 150, 154)

Clutter = Callable[[Assembly], None]


def bookshelf(here: Assembly, width: float, height: float, colour: Colour) -> None:
    """Put up shelves with books and other things; 0.3 m deep."""
    depth, board = 0.3, 0.025
    wood = materials.wood(colour)
    for side in (-1, 1):
        here.at(side * (width - board) / 2, -depth / 2).box((board, depth, height), wood)
    here.at(y=-0.01).panel(width, height, wood)
    shelves = round(height / 0.36)
    levels = np.linspace(0.06, height - board, shelves + 1)
    for level, above in zip(levels, [*levels[1:], None]):
        here.at(0, -depth / 2, level).box((width - 2 * board, depth, board), wood)
        if above is not None:
            _fill_shelf(here.at(0, -depth, level + board), width - 2 * board - 0.01,
                        above - level - board, depth)


def desk(here: Assembly, colour: Colour) -> None:
    """Add a desk with a computer, a lamp and papers, and a chair before it; 1.4 m wide."""
    width, depth, height = 1.4, 0.7, 0.74
    _table(here.at(0, -depth / 2), (width, depth, height), colour)
    here.at(0.45, -0.33).box((0.42, 0.5, height - 0.06), materials.wood(colour),
                             {'front': prints.drawers(colour, 1, 4)}, open_faces=('top',))
    top = here.at(z=height)
    screen(top.at(-0.15, -0.2, turn=here.rng.uniform(-0.15, 0.15)))
    top.at(-0.15, -0.5, turn=here.rng.uniform(-0.1, 0.1)).box(
        (0.44, 0.15, 0.02), materials.plain(_DARK), {'top': prints.keyboard})
    desk_lamp(top.at(-0.58, -0.2))
    globe(top.at(0.55, -0.18))
    for x, y in ((0.24, -0.5), (0.42, -0.35), (-0.52, -0.52)):
        top.at(x, y, 0.002, here.rng.uniform(-0.6, 0.6)).sheet(0.21, 0.297, prints.page)
    mug(top.at(0.18, -0.28))
    book_pile(top.at(0.56, -0.52), 4)
    chair(here.at(-0.2, -0.68, turn=np.pi + here.rng.uniform(-0.3, 0.3)), hue(here.rng))


def sofa(here: Assembly, colour: Colour) -> None:
    """Add a sofa with cushions; 1.9 m wide, 0.85 m deep."""
    width, depth = 1.9, 0.85
    cloth = materials.fabric(colour)
    here.at(0, -depth / 2).box((width, depth, 0.28), cloth)
    here.at(0, -0.12, 0.28).box((width, 0.24, 0.5), cloth)
    for side in (-1, 1):
        here.at(side * (width / 2 - 0.1), -depth / 2 - 0.04).box((0.2, depth - 0.06, 0.58), cloth)
        here.at(side * 0.375, -0.54, 0.28).box((0.73, 0.62, 0.14), cloth)
    for x in (-0.55, -0.1, 0.5):
        pattern = materials.fabric(hue(here.rng), hue(here.rng, (0.1, 0.5), (0.6, 0.95)))
        kind = (pattern, prints.rug)[int(here.rng.integers(2))]
        here.at(x, -0.36, 0.42, here.rng.uniform(-0.2, 0.2)).tilted(-0.3).box(
            (0.42, 0.12, 0.38), pattern, {'front': kind})


def cabinet(here: Assembly, width: float, colour: Colour, clutter: Sequence[Clutter]) -> None:
    """Add a chest of drawers with things on it; 0.45 m deep, 0.85 m high."""
    depth, height = 0.45, 0.85
    wood = materials.wood(colour)
    here.at(0, -depth / 2).box((width, depth, height), wood,
                               {'front': prints.drawers(colour, 2, 3)})
    here.at(0, -depth / 2, height).box((width + 0.04, depth + 0.02, 0.03), wood)
    for x, thing in zip(np.linspace(-0.4, 0.4, len(clutter)) * width, clutter):
        thing(here.at(x, -here.rng.uniform(0.18, 0.27), height + 0.03,
                      here.rng.uniform(-0.4, 0.4)))


def coffee_table(here: Assembly, colour: Colour) -> None:
    """Add a low table with things on it; 1.0 by 0.6 m."""
    _table(here, (1.0, 0.6, 0.42), colour)
    top = here.at(z=0.42)
    for x, y in ((-0.34, 0.1), (-0.2, -0.13), (0.1, 0.16)):
        top.at(x, y, turn=here.rng.uniform(-1, 1)).box(
            (0.21, 0.28, 0.012), materials.plain((230, 228, 220)), {'top': prints.cover})
    book_pile(top.at(0.36, 0.12), 3)
    mug(top.at(0.12, -0.14))
    bowl(top.at(0.34, -0.14))


def chair(here: Assembly, colour: Colour) -> None:
    """Add a chair with a padded seat; its front is where one sits down."""
    wood, cloth = materials.wood((120, 84, 54)), materials.fabric(colour)
    for x in (-0.19, 0.19):
        for y, height in ((-0.19, 0.44), (0.19, 0.92)):
            here.at(x, y).box((0.04, 0.04, height), wood, {'back': wood})
    here.at(z=0.44).box((0.44, 0.44, 0.06), cloth, {'back': cloth, 'bottom': wood})
    here.at(0, 0.19, 0.62).box((0.36, 0.03, 0.28), cloth, {'back': cloth, 'bottom': wood})


def stool(here: Assembly, colour: Colour) -> None:
    """Add a round, upholstered stool."""
    here.cone(0.2, 0.2, 0.42, materials.fabric(colour, hue(here.rng)), materials.fabric(colour))


def floor_lamp(here: Assembly) -> None:
    """Add a lamp with a cone of cloth."""
    here.cone(0.14, 0.13, 0.03, materials.plain(_DARK), materials.plain(_DARK))
    here.at(z=0.03).cone(0.016, 0.016, 1.35, materials.plain(_METAL))
    here.at(z=1.33).cone(0.22, 0.13, 0.3, materials.fabric((232, 214, 170), (190, 150, 90)))


def plant(here: Assembly) -> None:
    """Add a clipped tree in a pot."""
    here.cone(0.13, 0.17, 0.28, materials.glaze((176, 104, 72), (226, 190, 150)),
              materials.plain((58, 44, 36), 0.3))
    here.at(z=0.28).cone(0.02, 0.018, 0.4, materials.wood((110, 84, 56)))
    here.at(z=0.62).ball(0.24, materials.leaves())
    here.at(z=1.0).ball(0.16, materials.leaves())


def cartons(here: Assembly) -> None:
    """Stack a few cardboard boxes."""
    z = 0.0
    for size in ((0.52, 0.4, 0.36), (0.44, 0.34, 0.3), (0.32, 0.28, 0.2)):
        here.at(0, 0, z, here.rng.uniform(-0.25, 0.25)).box(size, prints.carton)
        z += size[2]


def screen(here: Assembly) -> None:
    """Add a monitor."""
    black = materials.plain((34, 34, 36))
    here.box((0.24, 0.18, 0.015), black)
    here.at(0, 0.02, 0.015).box((0.05, 0.04, 0.15), black)
    here.at(z=0.11).box((0.56, 0.035, 0.35), black)
    here.at(0, -0.019, 0.115).panel(0.55, 0.34, prints.screen, glows=True)


def desk_lamp(here: Assembly) -> None:
    """Add a small lamp."""
    here.cone(0.08, 0.075, 0.02, materials.plain(_DARK), materials.plain(_DARK))
    here.at(z=0.02).cone(0.01, 0.01, 0.3, materials.plain(_METAL))
    here.at(z=0.28).cone(0.11, 0.06, 0.14, materials.glaze(hue(here.rng), (240, 230, 210)))


def globe(here: Assembly) -> None:
    """Add a globe."""
    here.cone(0.07, 0.02, 0.08, materials.wood((90, 60, 40)))
    here.at(z=0.075).ball(0.12, prints.globe)


def mug(here: Assembly) -> None:
    """Add a mug."""
    here.cone(0.042, 0.042, 0.1, materials.glaze(hue(here.rng), hue(here.rng)),
              materials.plain((60, 40, 28)))


def vase(here: Assembly) -> None:
    """Add a vase with a ball of foliage."""
    clay = materials.glaze(hue(here.rng, (0.1, 0.4), (0.6, 0.9)), hue(here.rng))
    here.cone(0.05, 0.085, 0.12, clay)
    here.at(z=0.12).cone(0.085, 0.035, 0.12, clay)
    here.at(z=0.22).ball(0.11, materials.leaves(hue(here.rng, (0.4, 0.7), (0.5, 0.8))))


def bowl(here: Assembly) -> None:
    """Add a bowl of fruit."""
    here.cone(0.06, 0.12, 0.06, materials.glaze((214, 204, 190), (60, 84, 130)),
              materials.plain((70, 50, 40), 0.2))
    for x, y, colour in ((-0.05, 0.02, (190, 60, 44)), (0.04, 0.045, (214, 160, 50)),
                         (0.025, -0.045, (120, 150, 60))):
        here.at(x, y, 0.05).ball(0.042, materials.glaze(colour, scaled(colour, 0.7)))


def radio(here: Assembly) -> None:
    """Add a box with a speaker's cloth and dials."""
    here.box((0.32, 0.15, 0.2), materials.wood((112, 70, 44)),
             {'front': materials.fabric((200, 180, 140), (120, 90, 60))})
    for x in (-0.09, 0.09):
        here.at(x, -0.077, 0.065).panel(0.1, 0.1, prints.clock, shape=Disc)


def photograph(here: Assembly) -> None:
    """Add a framed picture that leans backwards."""
    here.tilted(0.2).box((0.2, 0.02, 0.26), materials.wood((70, 50, 36)),
                         {'front': prints.poster})


def book_pile(here: Assembly, count: int) -> None:
    """Lay some books on each other."""
    z = 0.0
    for _ in range(count):
        width, depth, height = here.rng.uniform((0.15, 0.2, 0.018), (0.2, 0.26, 0.045))
        here.at(0, 0, z, here.rng.uniform(-0.5, 0.5)).box(
            (width, depth, height), prints.spines, {'top': prints.cover})
        z += height


def book_row(here: Assembly, width: float, height: float, depth: float) -> None:
    """Add a row of books; the middle of its front is at (0, 0, 0)."""
    paper = materials.fabric((214, 204, 180))
    cloth = materials.plain(hue(here.rng))
    here.at(0, depth / 2).box((width, depth, height), cloth,
                              {'front': prints.spines, 'top': paper})


def wall_shelf(here: Assembly, width: float, colour: Colour) -> None:
    """Add a board on the wall with books on it; 0.22 m deep."""
    wood = materials.wood(colour)
    here.at(0, -0.11).box((width, 0.22, 0.025), wood, {'bottom': wood})
    _fill_shelf(here.at(0, -0.22, 0.025), width - 0.04, 0.34, 0.22)


def picture(here: Assembly, width: float, height: float, print_: Material) -> None:
    """Hang a picture on the wall."""
    wood = materials.wood((74, 54, 38))
    here.at(0, -0.0125).box((width, 0.025, height), wood, {'front': print_, 'bottom': wood})


def window(here: Assembly, width: float, height: float) -> None:
    """Put a window into the wall, with curtains to both sides."""
    here.at(y=-0.01).panel(width, height, prints.view, glows=True)
    sill = materials.plain((226, 222, 214))
    here.at(0, -0.08, -0.04).box((width + 0.1, 0.16, 0.04), sill, {'bottom': sill})
    cloth = materials.curtain(hue(here.rng, (0.3, 0.6), (0.4, 0.8)), (226, 214, 190))
    for side in (-1, 1):
        here.at(side * (width / 2 + 0.14), -0.09, -0.3).box((0.34, 0.08, height + 0.42), cloth)


CLUTTER: tuple[Clutter, ...] = (vase, radio, photograph, globe, lambda here: book_pile(here, 4))
"""Small things to stand on furniture."""


def _table(here: Assembly, size: tuple[float, float, float], colour: Colour) -> None:
    width, depth, height = size
    wood = materials.wood(colour)
    for x in (-1, 1):
        for y in (-1, 1):
            here.at(x * (width / 2 - 0.05), y * (depth / 2 - 0.05)).box(
                (0.06, 0.06, height - 0.04), wood, {'back': wood}, open_faces=('top',))
    here.at(z=height - 0.04).box((width, depth, 0.04), wood, {'back': wood, 'bottom': wood})


def _fill_shelf(here: Assembly, width: float, height: float, depth: float) -> None:
    """Fill a board, the middle of whose front is at (0, 0, 0), from left to right."""
    left = -width / 2
    while width / 2 - left > 0.1:
        room = width / 2 - left
        if here.rng.random() < 0.75 or room < 0.3:
            wide = min(here.rng.uniform(0.12, 0.4), room)
            tall = height * here.rng.uniform(0.68, 0.92)
            book_row(here.at(left + wide / 2, here.rng.uniform(0.02, 0.06)), wide, tall,
                     0.7 * depth)
            left += wide + here.rng.choice((0.002, 0.05))
        else:
            (vase, mug, photograph)[int(here.rng.integers(3))](here.at(left + 0.14, depth / 2))
            left += 0.28
