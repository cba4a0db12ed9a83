# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pictures of a scene: exact depth at the centres of pixels, colour averaged over pixels."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic.atlas import Atlas
from aick_ros.sources.synthetic.surfaces import Surface, TexturePoints

_NEAR = 0.02  # [m]; nothing nearer is seen
_NOTHING = -1
# where in a pixel the colour is sampled where it sees several surfaces [px]
_SUBSAMPLES = np.array([[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]])


class Picture(NamedTuple):
    """
    What a perfect camera sees.

    :param colour: HxWx3 (red, green, blue) uint8.
    :param depth: HxW float32, z at the centre of the pixel [m]; NaN where nothing is.
    """

    colour: np.ndarray
    depth: np.ndarray


class _Samples(NamedTuple):
    """Rays (x, y) and what they hit; N each, of inverse depth 0 and surface -1 where nothing."""

    x: np.ndarray
    y: np.ndarray
    inverse_depth: np.ndarray
    surface: np.ndarray


class Renderer:
    """
    Renders surfaces as a camera sees them.

    :param surfaces: all that can be seen.
    :param camera: without distortion.
    :raises InputError: where the camera has distortion.
    """

    def __init__(self, surfaces: Sequence[Surface], camera: Camera) -> None:
        if camera.distortion:
            raise InputError('the renderer takes a camera without distortion')
        self._surfaces = surfaces
        self._camera = camera
        self._atlas = Atlas(surfaces)
        self._T_surface_world = np.array([se3.inverse(s.T_world_surface) for s in surfaces])
        self._hulls = np.array([np.resize(s.hull, (8, 3)) for s in surfaces])
        self._one_sided = np.array([s.one_sided for s in surfaces])
        self._x = (np.arange(camera.width) - camera.cx) / camera.fx
        self._y = ((np.arange(camera.height) - camera.cy) / camera.fy)[:, None]

    def render(self, T_world_camera: np.ndarray) -> Picture:
        """Return what the camera sees from a pose."""
        T_surface_camera = self._T_surface_world @ T_world_camera
        inverse_depth, surface = self._cast_grid(T_world_camera, T_surface_camera)
        return Picture(self._colour(inverse_depth, surface, T_surface_camera),
                       _depth(inverse_depth))

    def render_depth(self, T_world_camera: np.ndarray) -> np.ndarray:
        """Return the depth alone, HxW float32 [m]; NaN where nothing is."""
        T_surface_camera = self._T_surface_world @ T_world_camera
        return _depth(self._cast_grid(T_world_camera, T_surface_camera)[0])

    def _cast_grid(self, T_world_camera: np.ndarray,
                   T_surface_camera: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cast a ray through the centre of each pixel; return inverse depths and surfaces."""
        shape = self._camera.height, self._camera.width
        nearest, surface = np.zeros(shape), np.full(shape, _NOTHING, np.int16)
        for i, (rows, columns) in self._boxes(T_world_camera, T_surface_camera):
            inverse_depth = self._surfaces[i].inverse_depth(
                T_surface_camera[i], self._x[columns], self._y[rows])
            nearer = inverse_depth > nearest[rows, columns]
            np.copyto(nearest[rows, columns], inverse_depth, where=nearer)
            np.copyto(surface[rows, columns], np.int16(i), where=nearer)
        return nearest, surface

    def _boxes(self, T_world_camera: np.ndarray,
               T_surface_camera: np.ndarray) -> list[tuple[int, tuple[slice, slice]]]:
        """Return the surfaces that may be seen, each with the rows and columns to look at."""
        T_camera_world = se3.inverse(T_world_camera)
        hulls = self._hulls @ T_camera_world[:3, :3].T + T_camera_world[:3, 3]
        candidates = np.flatnonzero(
            (hulls[..., 2].max(axis=1) > _NEAR)
            & ~(self._one_sided & (T_surface_camera[:, 2, 3] >= 0)))
        with np.errstate(divide='ignore', invalid='ignore'):
            seen = hulls[candidates, :, :2] / hulls[candidates, :, 2:]
        low, high = seen.min(axis=1), seen.max(axis=1)
        for k in np.flatnonzero(hulls[candidates, :, 2].min(axis=1) <= _NEAR):
            part = _in_front(hulls[candidates[k]])
            low[k], high[k] = part.min(axis=0), part.max(axis=0)
        camera = self._camera
        focal, centre = (camera.fx, camera.fy), (camera.cx, camera.cy)
        size = camera.width, camera.height
        start = np.clip(np.ceil(low * focal + centre), 0, size).astype(int)
        stop = np.clip(np.floor(high * focal + centre) + 1, 0, size).astype(int)
        return [(int(candidates[k]), (slice(start[k, 1], stop[k, 1]),
                                      slice(start[k, 0], stop[k, 0])))
                for k in np.flatnonzero((start < stop).all(axis=1))]

    def _colour(self, inverse_depth: np.ndarray, surface: np.ndarray,
                T_surface_camera: np.ndarray) -> np.ndarray:
        """Take one sample of the pixels that see one surface, several of the others."""
        edge = _edges(surface)
        edges = np.flatnonzero(edge)
        x, y = (np.broadcast_to(a, surface.shape) for a in (self._x, self._y))
        centres = _Samples(x, y, inverse_depth, np.where(edge, np.int16(_NOTHING), surface))
        subsamples = self._cast_subsamples(surface, edges, T_surface_camera)
        colours = self._shade(_joined(centres, subsamples), T_surface_camera)
        spread = colours[surface.size:].reshape(len(edges), len(_SUBSAMPLES), 3)
        colours[edges] = (spread.sum(axis=1) + len(_SUBSAMPLES) // 2) // len(_SUBSAMPLES)
        return colours[:surface.size].reshape(*surface.shape, 3)

    def _cast_subsamples(self, surface: np.ndarray, pixels: np.ndarray,
                         T_surface_camera: np.ndarray) -> _Samples:
        """Cast several rays through each pixel at what is seen around it."""
        rows, columns = np.divmod(pixels, self._camera.width)
        x = self._x[columns][:, None] + _SUBSAMPLES[:, 0] / self._camera.fx
        y = self._y[rows] + _SUBSAMPLES[:, 1] / self._camera.fy
        nearest, hit = np.zeros(x.shape), np.full(x.shape, _NOTHING, np.int16)
        for i, near in _neighbours(surface, rows, columns):
            inverse_depth = self._surfaces[i].inverse_depth(
                T_surface_camera[i], x.take(near, axis=0), y.take(near, axis=0))
            before = nearest.take(near, axis=0)
            nearest[near] = np.maximum(before, inverse_depth)
            hit[near] = np.where(inverse_depth > before, np.int16(i), hit.take(near, axis=0))
        return _Samples(x, y, nearest, hit)

    def _shade(self, samples: _Samples, T_surface_camera: np.ndarray) -> np.ndarray:
        """Return the colours of samples, Nx3 uint8; black where nothing is hit."""
        order = np.argsort(samples.surface, kind='stable')
        order = order[np.count_nonzero(samples.surface == _NOTHING):]
        x, y, inverse_depth, surface = (a.take(order) for a in samples)
        pixel_size = 1 / self._camera.fx
        points = TexturePoints(*(np.empty_like(x) for _ in TexturePoints._fields))
        for i, group in _groups(surface):
            found = self._surfaces[i].texture_points(
                T_surface_camera[i], x[group], y[group], inverse_depth[group], pixel_size)
            for whole, part in zip(points, found):
                whole[group] = part
        colours = np.zeros((len(samples.surface), 3), np.uint8)
        colours[order] = self._atlas.look_up(
            surface, points, np.float32(pixel_size) / inverse_depth)
        return colours


def _depth(inverse_depth: np.ndarray) -> np.ndarray:
    with np.errstate(divide='ignore'):
        depth = (1 / inverse_depth).astype(np.float32)
    depth[inverse_depth == 0] = np.nan
    return depth


def _in_front(points: np.ndarray) -> np.ndarray:
    """Return where a convex body is seen, by points (x, y) around its part in front."""
    z = points[:, 2]
    pairs = [(i, j) for i, j in itertools.permutations(range(len(points)), 2)
             if z[i] > _NEAR >= z[j]]
    crossings = [points[i] + (points[j] - points[i]) * ((z[i] - _NEAR) / (z[i] - z[j]))
                 for i, j in pairs]
    part = np.array([*points[z > _NEAR], *crossings])
    image: np.ndarray = part[:, :2] / part[:, 2:]
    return image


def _edges(surface: np.ndarray) -> np.ndarray:
    """Return which pixels have a neighbour that sees another surface."""
    edge = np.zeros(surface.shape, bool)
    beside, below = surface[:, 1:] != surface[:, :-1], surface[1:] != surface[:-1]
    edge[:, 1:] |= beside
    edge[:, :-1] |= beside
    edge[1:] |= below
    edge[:-1] |= below
    return edge


def _neighbours(surface: np.ndarray, rows: np.ndarray,
                columns: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Return each surface with the indices of those pixels in whose 3x3 neighbourhood it is."""
    height, width = surface.shape
    around = np.stack([
        surface[np.clip(rows + down, 0, height - 1), np.clip(columns + right, 0, width - 1)]
        for down, right in itertools.product((-1, 0, 1), repeat=2)], axis=1)
    around.sort(axis=1)
    new = np.ones(around.shape, bool)
    new[:, 1:] = around[:, 1:] != around[:, :-1]
    pixel = np.broadcast_to(np.arange(len(rows))[:, None], around.shape)[new]
    seen = around[new]
    order = np.argsort(seen, kind='stable')
    return [(i, pixel[order[group]]) for i, group in _groups(seen[order]) if i != _NOTHING]


def _joined(centres: _Samples, others: _Samples) -> _Samples:
    """Put samples of any shape in one row, as float32, which is enough for colour."""
    *numbers, surface = ([one.ravel(), other.ravel()] for one, other in zip(centres, others))
    joined = [np.concatenate(pair, dtype=np.float32, casting='same_kind') for pair in numbers]
    return _Samples._make([*joined, np.concatenate(surface)])


def _groups(values: np.ndarray) -> list[tuple[int, slice]]:
    """Return each of the sorted values with the stretch of the array that it fills."""
    if not len(values):
        return []
    starts = np.flatnonzero(np.diff(values, prepend=values[:1] - 1))
    return [(int(values[start]), slice(start, stop))
            for start, stop in zip(starts, [*starts[1:], len(values)])]
