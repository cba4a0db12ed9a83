# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Even selection of keypoints against a loop over the cells."""

from collections import defaultdict

import numpy as np
import pytest

from aick_ros.features.selection import spread


def round_robin(pixels, count, cell_size):
    """Take the strongest remaining keypoint of each cell in turn until there are enough."""
    cells = defaultdict(list)
    for i, (u, v) in enumerate(pixels):
        cells[int(u // cell_size), int(v // cell_size)].append(i)
    kept = []
    while len(kept) < min(count, len(pixels)):
        heads = sorted(cell.pop(0) for cell in cells.values() if cell)
        kept += heads[:count - len(kept)]
    return sorted(kept)


@pytest.mark.parametrize('count', [0, 1, 50, 200, 299, 300, 1000])
@pytest.mark.parametrize('cell_size', [10, 60, 1000])
def test_the_selection_is_round_robin(count, cell_size):
    rng = np.random.default_rng(0)
    crowd = rng.normal((100, 100), 10, (200, 2)).clip(0)
    pixels = rng.permutation(np.concatenate([crowd, rng.uniform(0, 480, (100, 2))]))
    assert spread(pixels, count, cell_size).tolist() == round_robin(pixels, count, cell_size)


def test_without_keypoints_the_selection_is_empty():
    assert len(spread(np.empty((0, 2), np.float32), 10, 60)) == 0


@pytest.mark.parametrize('u', [59.99, 60.0])
def test_a_cell_ends_where_the_next_one_begins(u):
    """Of the strongest two, both in the first cell, one is kept beside one of the second."""
    pixels = np.array([(10, 5), (20, 5), (u, 5)], float)
    assert spread(pixels, 2, 60).tolist() == ([0, 2] if u >= 60 else [0, 1])


def test_cells_of_one_row_are_not_those_of_the_next():
    pixels = np.array([(130, 10), (10, 70), (140, 10), (20, 70)], float)
    assert spread(pixels, 2, 60).tolist() == [0, 1]


def test_pixels_beside_the_image_are_in_its_outer_cells():
    pixels = np.array([(-5, 10), (10, -1e9), (1e12, 10), (1e15, 10), (70, 10)], float)
    assert spread(pixels, 3, 60).tolist() == [0, 2, 4]


@pytest.mark.parametrize('size', [0.0, -1.0, -1e19, np.nan, -np.inf])
def test_cells_without_a_size_are_refused(size):
    """With a negative size the pixel farthest out is not in the last cell."""
    with pytest.raises(ValueError, match='the size of the cells is not above 0'):
        spread(np.array([(0, 0), (10, 10), (1e12, 5)], float), 2, size)


@pytest.mark.parametrize('pixel', [(np.nan, np.nan), (np.inf, -np.inf), (-1e300, 1e300)])
@pytest.mark.parametrize('size', [1e-300, 60, np.inf])
def test_any_pixel_has_a_cell(pixel, size):
    assert spread(np.array([(5, 5), pixel], float), 2, size).tolist() == [0, 1]
