# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Surface of a depth image: points with normals on a coarse grid.

Everything is computed in inverse depth: there a plane is linear in the pixel coordinates, so that
averages and derivatives are exact, and the noise of a triangulating sensor is constant.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.borders.records import replaced
from aick_ros.errors import InputError
from aick_ros.frames.depth import noise
from aick_ros.frames.depth_cells import Grid, grid_of, inverse_depths
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

CELL = 4
"""Largest side of the cells that are averaged into one point [px].

Chosen: with 8 in images of 1280 pixels the drift over a second is a quarter larger."""

_CELLS_ACROSS = 160
"""Cells across an image whose width allows it with smaller ones.

Chosen on two excerpts of real recordings with half and a quarter of the resolution, and on rooms
by two cameras of few pixels: cells of four leave a sixth of the planes or fewer, and the drift
over a second is up to 1.7 times as large."""

FINE_CELL = 2
"""The largest side where depth has to do alone.

Chosen on two excerpts of real recordings, on which chains of registrations by depth end a quarter
nearer to the truth in the mean."""

_ROUGHNESS_BOUNDS = 1.0, 8.0  # chosen: standard deviations of the depth noise, of one pixel
_RELATIVE_ROUGHNESS = 8.0, 4.0
"""Largest roughness of a plane, as ratios to those of the smoothest tenth and quarter of cells.

Both are the noise of the camera, and differ by a tenth to a quarter. Where the quarter is much
rougher than the tenth, most of what is seen is no plane, as along shelves. A plane that is fitted
across a corner or a relief is rougher, and changes with the place from which it is seen. Chosen on
two excerpts of real recordings, on rendered corridors and on rooms with five kinds of cameras."""

_MIN_COSINE = 0.17  # chosen: between ray and normal, about 80 degrees
_BUCKETS = 8  # chosen: intervals of the normals, along x and along y
_NUMBERS = 256  # by definition: what intervals may have; the last one stands for none of them


def cell_of(camera: Camera) -> int:
    """Return the side of the cells of a camera's depth image [px]: smaller in small images."""
    return min(-(-camera.width // _CELLS_ACROSS), CELL)


@dataclass(frozen=True, eq=False)
class Surface:
    """
    Points and normals of a depth image, in the optical frame of the camera.

    :param grid: camera of the cells; M = width * height of them, row by row.
    :param points: Mx3 float32 [m].
    :param normals: Mx3 float32, pointing away from the camera (n . p > 0).
    :param usable: M bool, whether a plane fits: no edge, no hole, no grazing angle.
    :param chosen: K indices of the cells selected to constrain a motion.
    :param roughness: M float32, standard deviation of the inverse depths about the plane [1/m].
    """

    grid: Grid
    points: np.ndarray
    normals: np.ndarray
    usable: np.ndarray
    chosen: np.ndarray
    roughness: np.ndarray

    @classmethod
    def of(cls, depth: np.ndarray, camera: Camera, sensor: SensorSettings,
           count: int, cell: int | None = None) -> Surface:
        """
        Return the surface of a depth image.

        :param depth: HxW float32 [m], NaN where invalid.
        :param count: maximum number of chosen cells.
        :param cell: their side [px]; None: :func:`cell_of` the camera.
        :raises InputError: where the image is smaller than the largest cell.
        """
        if min(camera.width, camera.height) < CELL:
            raise InputError(f'the depth image is {camera.width} x {camera.height} pixels: at '
                             f'least {CELL} x {CELL} are required')
        cell = cell or cell_of(camera)
        grid = grid_of(camera, cell)
        cells = grid.width * grid.height
        points, normals = np.empty((2, cells, 3), np.float32)
        roughness, cosines = np.empty((2, cells), np.float32)
        usable = np.empty(cells, bool)
        kernels.fit_planes(inverse_depths(depth, camera, sensor, cell), grid.intrinsics, points,
                           normals, roughness, cosines)
        kernels.smooth_cells(
            points, roughness.reshape(grid.height, grid.width), cosines, noise(sensor),
            *_RELATIVE_ROUGHNESS, *_ROUGHNESS_BOUNDS, _MIN_COSINE, usable)
        return cls(grid, points, normals, usable, _choose(normals, usable, count), roughness)

    @functools.cached_property
    def even(self) -> Surface:
        """The same with as many chosen cells, spread evenly over the usable ones."""
        order = shuffled(len(self.usable))
        chosen = np.sort(order[self.usable.take(order)][:len(self.chosen)])
        return replaced(self, chosen=chosen)

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Shares of the usable cells whose normals are in each interval; zero in none."""
        _, sizes = _buckets(self.normals, self.usable)
        shares = np.zeros(_NUMBERS)
        shares[:len(sizes)] = sizes / max(int(sizes.sum()), 1)
        return shares

    def shares_facing(self, normals: np.ndarray) -> np.ndarray:
        """
        Return which share of the usable cells faces about as each of some normals do, N.

        :param normals: Nx3, of length one.
        """
        facing, _ = _buckets(normals.astype(np.float32), np.ones(len(normals), bool))
        return self._shares.take(facing)

    def cells_at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the usable cells onto which points project.

        :param points: Nx3 in the optical frame [m].
        :returns: K indices of the points that project onto a usable cell, and K of the cells.
        """
        indices, cells = np.empty((2, len(points)), np.int64)
        found = kernels.cells_at(points, self.usable, self.grid.width, self.grid.height,
                                 self.grid.intrinsics, indices, cells)
        return indices[:found], cells[:found]


def _choose(normals: np.ndarray, usable: np.ndarray, count: int) -> np.ndarray:
    """
    Return cells whose normals cover all directions present (normal-space sampling).

    All buckets of directions contribute up to the same number of cells, spread over the image, so
    that a small box in front of a large wall still constrains the direction that only it observes.
    """
    buckets, sizes = _buckets(normals, usable)
    if sizes.sum() <= count:
        return usable.nonzero()[0]
    chosen = np.empty(len(usable), bool)
    kernels.choose_cells(shuffled(len(usable)), buckets, sizes, count, chosen)
    return chosen.nonzero()[0]


def _buckets(normals: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the interval of each normal, where it is usable, and how many each interval has."""
    buckets, sizes = np.empty(len(usable), np.uint8), np.empty(_BUCKETS ** 2, np.int64)
    kernels.normal_buckets(normals, usable, _BUCKETS, buckets, sizes)
    return buckets, sizes


@functools.lru_cache(maxsize=8)
def shuffled(count: int) -> np.ndarray:
    """Return the numbers below the count in a fixed random order."""
    return np.random.default_rng(0).permutation(count)
