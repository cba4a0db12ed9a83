# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Light and soft shadows, computed once and painted into the textures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.assembly import Block
from aick_ros.sources.synthetic.surfaces import Surface

_CELL = 0.07  # [m] between places at which light is computed
_OFF = 0.01  # [m] from the surface at which a ray of light ends
_CORNER = 0.15  # [m]; what is nearer to something than this gets less of the light from all around
_AROUND = np.array([0.54, 0.53, 0.52], np.float32)  # light from all around
_SHADOWING = 0.25  # [m]; smaller blocks throw no shadow


@dataclass(frozen=True, eq=False)
class Lamp:
    """
    A glowing rectangle.

    :param points: Nx3, spread over it [m].
    :param direction: in which it shines most.
    :param power: red, green, blue; 1 lights white to white at one metre.
    :param reach: what is farther away gets no light of it [m].
    """

    points: np.ndarray
    direction: np.ndarray
    power: np.ndarray
    reach: float = np.inf


def illuminate(surfaces: Sequence[Surface], blocks: Sequence[Block], lamps: Sequence[Lamp],
               clearance: Callable[[np.ndarray], np.ndarray]) -> list[Surface]:
    """
    Return the surfaces with the light in their pictures.

    :param clearance: distance of Nx3 points to the nearest thing [m].
    """
    grids = [_grid(surface) for surface in surfaces]
    points, normals = (np.concatenate(parts).astype(np.float32) for parts in
                       zip(*(s.points(*places) for s, (_, *places) in zip(surfaces, grids))))
    light = _AROUND * np.clip(clearance(points + _CORNER * normals) / _CORNER, 0.45, 1)[:, None]
    points += _OFF * normals
    shadowing = [block for block in blocks if block.size.max() > _SHADOWING]
    for lamp in lamps:
        near = [block for block in shadowing if block.distance(lamp.points).min() < lamp.reach]
        for source in lamp.points.astype(np.float32):
            light += _from_lamp(points, normals, source, lamp, near) / len(lamp.points)
    ends = np.cumsum([shape[0] * shape[1] for shape, *_ in grids])[:-1]
    return [surface.with_image(_lit(surface.image, part.reshape(*shape, 3)))
            for surface, part, (shape, *_) in zip(surfaces, np.split(light, ends), grids)]


def _grid(surface: Surface) -> tuple[tuple[int, int], np.ndarray, np.ndarray]:
    """Return a grid of places on a surface: rows and columns, s, t."""
    rows, columns = (max(1, round(n / _CELL)) for n in (surface.height, surface.width))
    t, s = np.mgrid[:rows, :columns] + 0.5
    return ((rows, columns), s.ravel() * surface.width / columns,
            t.ravel() * surface.height / rows)


def _from_lamp(points: np.ndarray, normals: np.ndarray, source: np.ndarray, lamp: Lamp,
               blocks: Sequence[Block]) -> np.ndarray:
    ray = source - points
    squared = np.einsum('ij,ij->i', ray, ray)
    received = np.einsum('ij,ij->i', ray, normals)
    sent = -(ray @ lamp.direction.astype(np.float32))
    lit = np.flatnonzero((received > 0) & (sent > 0) & (squared < lamp.reach ** 2))
    for block in blocks:
        lit = lit[~_blocked(points[lit], ray[lit], block)]
    light = np.zeros(len(points), np.float32)
    # at least half a metre, so that what is beside a lamp does not glare
    light[lit] = received[lit] * sent[lit] / (squared[lit] * np.maximum(squared[lit], 0.25))
    coloured: np.ndarray = light[:, None] * lamp.power.astype(np.float32)
    return coloured


def _blocked(points: np.ndarray, rays: np.ndarray, block: Block) -> np.ndarray:
    """Return whether a block is between points and points + rays, N bool."""
    T_block_world = se3.inverse(block.T_world_block).astype(np.float32)
    start = T_block_world[:3, :3] @ points.T + T_block_world[:3, 3:]
    ray = T_block_world[:3, :3] @ rays.T
    ray[np.abs(ray) < 1e-9] = 1e-9
    half = (block.size / 2).astype(np.float32)[:, None]
    one, other = (-half - start) / ray, (half - start) / ray
    enters = np.minimum(one, other).max(axis=0)
    leaves = np.maximum(one, other).min(axis=0)
    blocked: np.ndarray = (enters < leaves) & (leaves > 0) & (enters < 1)
    return blocked


def _lit(image: np.ndarray, light: np.ndarray) -> np.ndarray:
    light = cv2.resize(light, image.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    return cv2.multiply(image, light, dtype=cv2.CV_8U)
