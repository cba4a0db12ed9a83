# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A scene to render: its surfaces, its obstacles, and where a camera may go."""

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
        """The centre, 3 [m]."""
        centre: np.ndarray = (self.low + self.high) / 2
        return centre

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how far inside Nx3 points are [m], negative outside."""
        depth: np.ndarray = np.minimum(points - self.low, self.high - points).min(axis=1)
        return depth


@dataclass(frozen=True, eq=False)
class Scene:
    """
    Surfaces and obstacles; world z is up, the floor at 0.

    :param surfaces: all visible surfaces.
    :param blocks: all obstacles.
    :param interior: the space between the walls, floor and ceiling.
    :param free: the space where a camera may be.
    """

    surfaces: tuple[Surface, ...]
    blocks: tuple[Block, ...]
    interior: Zone
    free: Zone

    @classmethod
    def assemble(cls, assembly: Assembly, lamps: list[Lamp], interior: Zone, free: Zone) -> Scene:
        """Make a scene of an assembly, lit by lamps."""
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
