# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Blob detection: maxima of the box-filter Hessian over position and scale (Bay et al. 2008).

The second derivatives of a Gaussian are approximated by box filters. An integral image gives their
responses at a cost independent of their size, so the filter is scaled instead of the image.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

SCALE_OF_SIZE = 1.2 / 9.0
"""Standard deviation of the Gaussian that a filter approximates, relative to its side (Bay)."""

_CROSS_WEIGHT = 0.81  # of D_xy squared: corrects for the boxes (Bay et al. 2008: 0.9^2)
_CUBE = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing='ij'), axis=-1).reshape(-1, 3)
_CENTRE = 13
_MAX_OFFSET = 0.75  # samples between maximum and vertex; chosen: 0.5 and the error of the fit


@dataclass(frozen=True, eq=False)
class Blobs:
    """
    Positions, sizes and responses of N blobs.

    :param pixels: Nx2 float32 (u, v) [px].
    :param sizes: N float32, sides of the filters with the maximum response [px].
    :param responses: N float32, determinants of the Hessian of an image of grey levels 0 to 1.
    """

    pixels: np.ndarray
    sizes: np.ndarray
    responses: np.ndarray


def find_blobs(grey: np.ndarray, octaves: int, intervals: int, step: int,
               threshold: float) -> Blobs:
    """
    Return the maxima of the determinant among their 26 neighbours, interpolated.

    :param grey: HxW uint8.
    :param octaves: number of octaves; the steps in position and scale double from one to the next.
    :param intervals: filters per octave, at least 3; the smallest and the largest have no maxima.
    :param step: sampling step of the first octave [px].
    :param threshold: minimum determinant.
    """
    found = [np.empty((4, 0), np.float32)]
    taken: dict[int, np.ndarray] = {}
    for octave, sizes, layers in _octaves(grey, octaves, intervals, step):
        octave_step, growth = step << octave, sizes[1] - sizes[0]
        for middle in range(1, intervals - 1):
            candidates = _candidates(layers[middle], threshold,
                                     _fitting(grey.shape, sizes[middle + 1], octave_step))
            if sizes[middle] in taken:  # the previous octave searched this layer with a finer step
                candidates &= ~taken[sizes[middle]]
            offsets, nodes, responses = _maxima(layers[middle - 1:middle + 2], candidates)
            taken[sizes[middle]] = _neighbourhood(nodes, candidates.shape)[::2, ::2]
            found.append(np.stack([
                octave_step * (nodes[1] + offsets[2]), octave_step * (nodes[0] + offsets[1]),
                sizes[middle] + growth * offsets[0], responses]))
    u, v, sizes, responses = np.concatenate(found, axis=1).astype(np.float32)
    return Blobs(np.column_stack([u, v]), sizes, responses)


def filter_sizes(octave: int, intervals: int) -> list[int]:
    """Return the sides of the filters of an octave [px]; of the first: 9, 15, 21, ..."""
    return [3 * ((2 << octave) * (interval + 1) + 1) for interval in range(intervals)]


def determinants(grid: BoxSums, size: int, step: int) -> np.ndarray:
    """
    Return the determinant of the Hessian, 0 where the filter exceeds the image.

    :param size: side of the filter, three times an odd number [px].
    :param step: sampling step [px].
    :returns: float32, a sample for each ``step`` rows and columns, from the first on.
    """
    height, width = grid.image_shape
    samples = np.zeros((-(-height // step), -(-width // step)), np.float32)
    inner = samples[_fitting(grid.image_shape, size, step)]
    if not inner.size:
        return samples
    first = -(-(size // 2) // step)
    lobe = size // 3
    half, middle = size // 2, lobe // 2

    def box(top: int, left: int, box_height: int, box_width: int) -> np.ndarray:
        return grid.sums(top, left, box_height, box_width, step, first, inner.shape)

    d_xx = box(1 - lobe, -half, 2 * lobe - 1, size)
    d_xx -= 3 * box(1 - lobe, -middle, 2 * lobe - 1, lobe)
    d_yy = box(-half, 1 - lobe, size, 2 * lobe - 1)
    d_yy -= 3 * box(-middle, 1 - lobe, lobe, 2 * lobe - 1)
    d_xy = box(-lobe, 1, lobe, lobe)
    d_xy += box(1, -lobe, lobe, lobe)
    d_xy -= box(-lobe, -lobe, lobe, lobe)
    d_xy -= box(1, 1, lobe, lobe)
    np.multiply(d_xx, d_yy, out=inner, dtype=np.float32, casting='unsafe')
    cross = d_xy.astype(np.float32)
    inner -= np.float32(_CROSS_WEIGHT) * cross * cross
    inner *= np.float32((255.0 * size * size) ** -2)
    return samples


class BoxSums:
    """
    Box sums of an image at all nodes of a grid.

    The integral image is stored split into its phases (polyphase), so that neighbouring nodes of a
    grid are adjacent in memory.

    :param grey: HxW uint8.
    :param phases: common divisor of the steps of the grids [px].
    """

    def __init__(self, grey: np.ndarray, phases: int) -> None:
        self.image_shape = grey.shape
        integral = cv2.integral(grey)  # int32; differences are right even if it overflows
        self._phases = phases
        self._planes = [[np.ascontiguousarray(integral[row::phases, column::phases])
                         for column in range(phases)] for row in range(phases)]

    def sums(self, top: int, left: int, height: int, width: int, step: int, first: int,
             shape: tuple[int, int]) -> np.ndarray:
        """
        Return the sums over a box at each node, int32.

        :param top: first row of the box, relative to the node [px]; ``left``: first column.
        :param step: distance between nodes [px].
        :param first: index of the first node in both directions.
        :param shape: number of nodes in both directions.
        """
        row, column = first * step + top, first * step + left
        total: np.ndarray = np.subtract(self._corner(row + height, column + width, step, shape),
                                        self._corner(row, column + width, step, shape))
        total -= self._corner(row + height, column, step, shape)
        total += self._corner(row, column, step, shape)
        return total

    def _corner(self, row: int, column: int, step: int, shape: tuple[int, int]) -> np.ndarray:
        (row, row_phase), (column, column_phase) = (
            divmod(index, self._phases) for index in (row, column))
        plane, stride = self._planes[row_phase][column_phase], step // self._phases
        corners: np.ndarray = plane[row:row + shape[0] * stride:stride,
                                    column:column + shape[1] * stride:stride]
        return corners


def _octaves(grey: np.ndarray, octaves: int, intervals: int,
             step: int) -> Iterator[tuple[int, list[int], list[np.ndarray]]]:
    """Yield number, filter sizes and determinants of each octave that fits into the image."""
    grid = BoxSums(grey, step)
    known: dict[int, np.ndarray] = {}
    for octave in range(octaves):
        sizes = filter_sizes(octave, intervals)
        if sizes[2] > min(grey.shape):
            return
        known = {size: layer[::2, ::2] for size, layer in known.items()}
        known = {size: known[size] if size in known else determinants(grid, size, step << octave)
                 for size in sizes}
        yield octave, sizes, list(known.values())


def _candidates(layer: np.ndarray, threshold: float, inside: tuple[slice, slice]) -> np.ndarray:
    """Return a mask of the maxima within a layer that exceed the threshold."""
    candidates = np.zeros(layer.shape, bool)
    np.greater_equal(layer[inside], cv2.dilate(layer, np.ones((3, 3), np.uint8))[inside],
                     out=candidates[inside])
    candidates[inside] &= layer[inside] > threshold
    return candidates


def _neighbourhood(nodes: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return a mask of given samples and their neighbours."""
    mask = np.zeros(shape, np.uint8)
    mask[nodes[0], nodes[1]] = 1
    return cv2.dilate(mask, np.ones((3, 3), np.uint8)).astype(bool)


def _maxima(layers: list[np.ndarray],
            candidates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return the maxima over position and scale among candidates of the middle of three layers.

    :returns: 3xN offsets (scale, row, column) in samples, 2xN (row, column), N responses.
    """
    row, column = np.nonzero(candidates)
    around = np.stack([
        layers[scale + 1][row + down, column + right] for scale, down, right in _CUBE])
    centre = around[_CENTRE]
    # strict towards earlier neighbours only: of two equal ones, as of a blob between, one counts
    maximum = ((around[:_CENTRE] < centre) & (around[_CENTRE + 1:] <= centre)).all(axis=0)
    offsets = _vertex(around[:, maximum].astype(np.float64))
    close = (np.abs(offsets) <= _MAX_OFFSET).all(axis=0)
    kept = np.flatnonzero(maximum)[close]
    return offsets[:, close], np.stack([row[kept], column[kept]]), centre[kept]


def _vertex(cube: np.ndarray) -> np.ndarray:
    """
    Return the vertices of the paraboloids through samples and their neighbours.

    :param cube: 27xN, the 3x3x3 neighbourhoods, row-major.
    :returns: 3xN offsets in samples; not finite if the Hessian is singular.
    """
    c = cube.reshape(3, 3, 3, -1)
    gradient = 0.5 * np.stack([c[2, 1, 1] - c[0, 1, 1], c[1, 2, 1] - c[1, 0, 1],
                               c[1, 1, 2] - c[1, 1, 0]])
    h_ss, h_yy, h_xx = (a + b - 2 * c[1, 1, 1] for a, b in (
        (c[2, 1, 1], c[0, 1, 1]), (c[1, 2, 1], c[1, 0, 1]), (c[1, 1, 2], c[1, 1, 0])))
    h_sy = 0.25 * (c[2, 2, 1] - c[2, 0, 1] - c[0, 2, 1] + c[0, 0, 1])
    h_sx = 0.25 * (c[2, 1, 2] - c[2, 1, 0] - c[0, 1, 2] + c[0, 1, 0])
    h_yx = 0.25 * (c[1, 2, 2] - c[1, 2, 0] - c[1, 0, 2] + c[1, 0, 0])
    adjugate = np.array([  # of the symmetric Hessian: Cramer's rule
        [h_yy * h_xx - h_yx ** 2, h_sx * h_yx - h_sy * h_xx, h_sy * h_yx - h_sx * h_yy],
        [h_sx * h_yx - h_sy * h_xx, h_ss * h_xx - h_sx ** 2, h_sy * h_sx - h_ss * h_yx],
        [h_sy * h_yx - h_sx * h_yy, h_sy * h_sx - h_ss * h_yx, h_ss * h_yy - h_sy ** 2]])
    determinant = h_ss * adjugate[0, 0] + h_sy * adjugate[0, 1] + h_sx * adjugate[0, 2]
    with np.errstate(divide='ignore', invalid='ignore'):
        vertices: np.ndarray = -np.einsum('ijn,jn->in', adjugate, gradient) / determinant
    return vertices


def _fitting(image_shape: tuple[int, int], size: int, step: int) -> tuple[slice, slice]:
    """Return the rows and columns of samples whose filter lies inside the image."""
    half = size // 2
    rows, columns = (slice(-(-half // step), max((length - 1 - half) // step + 1, 0))
                     for length in image_shape)
    return rows, columns
