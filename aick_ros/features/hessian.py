# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Blobs of an image: maxima over position and scale of the box-filter Hessian (Bay et al. 2008).

The second derivatives of a Gaussian are replaced by boxes, whose sums an integral image gives at
a cost that does not depend on their size. So the image stays as it is, and the filter grows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

SCALE_OF_SIZE = 1.2 / 9.0
"""Standard deviation of the Gaussian that a filter approximates, as a share of its side."""

_CROSS_WEIGHT = 0.81  # of D_xy squared: what the boxes change in the determinant
_CUBE = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing='ij'), axis=-1).reshape(-1, 3)
_CENTRE = 13
_REACH = 0.75  # samples from a maximum to its vertex: half of one, and what the fit is off


@dataclass(frozen=True, eq=False)
class Blobs:
    """
    Where, how large and how strong.

    :param pixels: Nx2 float32 (u, v) [px].
    :param sizes: N float32, sides of the filters that answer most [px].
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
    :param octaves: how often the steps in position and in scale double.
    :param intervals: filters of an octave, 3 or more; all but the outermost can have a maximum.
    :param step: distance of the samples of the first octave [px].
    :param threshold: least determinant.
    """
    found = [np.empty((4, 0), np.float32)]
    taken: dict[int, np.ndarray] = {}
    for octave, sizes, layers in _octaves(grey, octaves, intervals, step):
        octave_step, growth = step << octave, sizes[1] - sizes[0]
        for middle in range(1, intervals - 1):
            candidates = _candidates(layers[middle], threshold,
                                     _fitting(grey.shape, sizes[middle + 1], octave_step))
            if sizes[middle] in taken:  # the octave before searched this layer too, more finely
                candidates &= ~taken[sizes[middle]]
            offsets, nodes, responses = _maxima(layers[middle - 1:middle + 2], candidates)
            taken[sizes[middle]] = _beside(nodes, candidates.shape)[::2, ::2]
            found.append(np.stack([
                octave_step * (nodes[1] + offsets[2]), octave_step * (nodes[0] + offsets[1]),
                sizes[middle] + growth * offsets[0], responses]))
    u, v, sizes, responses = np.concatenate(found, axis=1).astype(np.float32)
    return Blobs(np.column_stack([u, v]), sizes, responses)


def filter_sizes(octave: int, intervals: int) -> list[int]:
    """Return the sides of the filters of an octave [px]: 9, 15, 21, ... of the first."""
    return [3 * ((2 << octave) * (interval + 1) + 1) for interval in range(intervals)]


def determinants(grid: BoxSums, size: int, step: int) -> np.ndarray:
    """
    Return the determinant of the Hessian at every so many pixels, 0 where the filter sticks out.

    :param size: side of the filter, three times an odd number [px].
    :returns: float32, one sample for the first of each ``step`` rows and columns.
    """
    height, width = grid.image_shape
    answers = np.zeros((-(-height // step), -(-width // step)), np.float32)
    answer = answers[_fitting(grid.image_shape, size, step)]
    if not answer.size:
        return answers
    first = -(-(size // 2) // step)
    lobe = size // 3
    half, middle = size // 2, lobe // 2

    def box(top: int, left: int, box_height: int, box_width: int) -> np.ndarray:
        return grid.sums(top, left, box_height, box_width, step, first, answer.shape)

    d_xx = box(1 - lobe, -half, 2 * lobe - 1, size)
    d_xx -= 3 * box(1 - lobe, -middle, 2 * lobe - 1, lobe)
    d_yy = box(-half, 1 - lobe, size, 2 * lobe - 1)
    d_yy -= 3 * box(-middle, 1 - lobe, lobe, 2 * lobe - 1)
    d_xy = box(-lobe, 1, lobe, lobe)
    d_xy += box(1, -lobe, lobe, lobe)
    d_xy -= box(-lobe, -lobe, lobe, lobe)
    d_xy -= box(1, 1, lobe, lobe)
    np.multiply(d_xx, d_yy, out=answer, dtype=np.float32, casting='unsafe')
    cross = d_xy.astype(np.float32)
    answer -= np.float32(_CROSS_WEIGHT) * cross * cross
    answer *= np.float32((255.0 * size * size) ** -2)
    return answers


class BoxSums:
    """
    Sums over boxes of an image, at all nodes of a grid at once.

    Grids of even steps are what is asked for: the integral image is kept split into its phases,
    so that neighbouring nodes lie side by side in memory.

    :param grey: HxW uint8.
    :param phases: steps asked for are multiples of it [px].
    """

    def __init__(self, grey: np.ndarray, phases: int) -> None:
        self.image_shape = grey.shape
        integral = cv2.integral(grey)  # int32, which may wrap: differences come out right
        self._phases = phases
        self._planes = [[np.ascontiguousarray(integral[row::phases, column::phases])
                         for column in range(phases)] for row in range(phases)]

    def sums(self, top: int, left: int, height: int, width: int, step: int, first: int,
             shape: tuple[int, int]) -> np.ndarray:
        """
        Return the sums over a box around each node, int32.

        :param top: first row of the box, counted from the node [px]; left: first column.
        :param step: distance of the nodes [px].
        :param first: number of the first node in both directions.
        :param shape: how many nodes there are.
        """
        row, column = first * step + top, first * step + left
        total = self._corner(row + height, column + width, step, shape)
        total = total - self._corner(row, column + width, step, shape)
        total -= self._corner(row + height, column, step, shape)
        total += self._corner(row, column, step, shape)
        return total

    def _corner(self, row: int, column: int, step: int, shape: tuple[int, int]) -> np.ndarray:
        (row, row_phase), (column, column_phase) = (
            divmod(place, self._phases) for place in (row, column))
        plane, stride = self._planes[row_phase][column_phase], step // self._phases
        return plane[row:row + shape[0] * stride:stride, column:column + shape[1] * stride:stride]


def _octaves(grey: np.ndarray, octaves: int, intervals: int,
             step: int) -> Iterator[tuple[int, list[int], list[np.ndarray]]]:
    """Yield each octave in which a filter fits: its number, sizes, and determinants."""
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
    """Return which samples inside are maxima of their own layer, above a threshold."""
    candidates = np.zeros(layer.shape, bool)
    np.greater_equal(layer[inside], cv2.dilate(layer, np.ones((3, 3), np.uint8))[inside],
                     out=candidates[inside])
    candidates[inside] &= layer[inside] > threshold
    return candidates


def _beside(nodes: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the samples that are, or are next to, some of them."""
    mask = np.zeros(shape, np.uint8)
    mask[nodes[0], nodes[1]] = 1
    return cv2.dilate(mask, np.ones((3, 3), np.uint8)).astype(bool)


def _maxima(layers: list[np.ndarray],
            candidates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return the maxima among some samples of the middle of three layers.

    :returns: 3xN offsets (scale, row, column) in samples, 2xN (row, column), N responses.
    """
    row, column = np.nonzero(candidates)
    around = np.stack([
        layers[scale + 1][row + down, column + right] for scale, down, right in _CUBE])
    centre = around[_CENTRE]
    # of two equal neighbours, as both sides of a blob between them are, one is taken
    maximum = ((around[:_CENTRE] < centre) & (around[_CENTRE + 1:] <= centre)).all(axis=0)
    offsets = _vertex(around[:, maximum].astype(np.float64))
    close = (np.abs(offsets) <= _REACH).all(axis=0)
    kept = np.flatnonzero(maximum)[close]
    return offsets[:, close], np.stack([row[kept], column[kept]]), centre[kept]


def _vertex(cube: np.ndarray) -> np.ndarray:
    """
    Return where the paraboloid through samples and their neighbours has its vertex.

    :param cube: 27xN, the three directions in turn, the last one fastest.
    :returns: 3xN in samples; not finite where there is none.
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
        return -np.einsum('ijn,jn->in', adjugate, gradient) / determinant


def _fitting(image_shape: tuple[int, int], size: int, step: int) -> tuple[slice, slice]:
    """Return the samples around which a filter lies inside the image."""
    half = size // 2
    rows, columns = (slice(-(-half // step), max((length - 1 - half) // step + 1, 0))
                     for length in image_shape)
    return rows, columns
