# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A scene to render: its surfaces, what is in the way, and where a camera may go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.sources.synthetic.assembly import Assembly, Block
from aick_ros.sources.synthetic.lighting import Lamp, illuminate
from aick_ros.sources.synthetic.surfaces import Surface


@dataclass(frozen=True, eq=False)
class Zone:
    """A box along the axes of the world, from one corner to the opposite one, 3 each [m]."""

    low: np.ndarray
    high: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """The middle."""
        return (self.low + self.high) / 2

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how far inside Nx3 points are [m], negative outside."""
        return np.minimum(points - self.low, self.high - points).min(axis=1)


@dataclass(frozen=True, eq=False)
class Scene:
    """
    What is there to see; world z is up, the floor at 0.

    :param surfaces: all that is seen.
    :param blocks: all that is in the way.
    :param interior: between the walls, floor and ceiling.
    :param free: where a camera may be.
    """

    surfaces: tuple[Surface, ...]
    blocks: tuple[Block, ...]
    interior: Zone
    free: Zone

    @classmethod
    def assemble(cls, assembly: Assembly, lamps: list[Lamp], interior: Zone, free: Zone) -> Scene:
        """Make a scene of what was put together, lit by lamps."""
        blocks = tuple(assembly.blocks)
        dark = cls((), blocks, interior, free)
        lit = illuminate(assembly.surfaces, blocks, lamps, dark.clearance)
        return cls((*lit, *assembly.glowing), blocks, interior, free)

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of Nx3 points to the nearest thing or wall [m]."""
        clearance = self.interior.depth(points)
        for block in self.blocks:
            clearance = np.minimum(clearance, block.distance(points))
        return clearance
