# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Blobs against direct summation, rendered blobs, and an independent implementation."""

import cv2
import numpy as np
import pytest

from aick_ros.features.hessian import BoxSums, _vertex, determinants, filter_sizes, find_blobs
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource


def noise(seed, height=61, width=74):
    rng = np.random.default_rng(seed)
    return cv2.GaussianBlur(rng.integers(0, 256, (height, width), dtype=np.uint8), (0, 0), 2.0)


def blob(centre, sigma, size=(320, 240)):
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    square = (x - centre[0]) ** 2 + (y - centre[1]) ** 2
    return np.uint8(np.rint(30 + 200 * np.exp(-0.5 * square / sigma ** 2)))


def filters(size):
    """D_xx, D_yy and D_xy of Bay et al. as images of weights."""
    lobe = size // 3
    along = np.repeat([1, -2, 1], lobe)
    across = np.zeros(size)
    across[(size - 2 * lobe + 1) // 2:][:2 * lobe - 1] = 1
    halves = np.zeros(size)
    halves[size // 2 - lobe:size // 2], halves[size // 2 + 1:size // 2 + 1 + lobe] = 1, -1
    return np.outer(across, along), np.outer(along, across), np.outer(halves, halves)


def determinant_by_summation(grey, row, column, size):
    half = size // 2
    window = grey[row - half:row + half + 1, column - half:column + half + 1] / 255.0
    d_xx, d_yy, d_xy = ((window * weights).sum() / size ** 2 for weights in filters(size))
    return d_xx * d_yy - 0.81 * d_xy ** 2


def test_filter_sizes_are_those_of_the_paper():
    assert filter_sizes(0, 4) == [9, 15, 21, 27]
    assert filter_sizes(1, 4) == [15, 27, 39, 51]
    assert filter_sizes(2, 4) == [27, 51, 75, 99]


@pytest.mark.parametrize('phases, step', [(1, 1), (1, 4), (2, 2), (2, 4), (3, 6)])
@pytest.mark.parametrize('size', [9, 27, 51])
def test_determinants_are_those_of_direct_summation(phases, step, size):
    grey = noise(1)
    found = determinants(BoxSums(grey, phases), size, step)
    assert found.shape == grey[::step, ::step].shape
    for i, row in enumerate(range(0, grey.shape[0], step)):
        for j, column in enumerate(range(0, grey.shape[1], step)):
            exceeds = min(row, column, grey.shape[0] - 1 - row,
                          grey.shape[1] - 1 - column) < size // 2
            expected = 0.0 if exceeds else determinant_by_summation(grey, row, column, size)
            assert found[i, j] == pytest.approx(expected, rel=1e-4, abs=1e-9)


def test_box_sums_survive_the_overflow_of_the_integral():
    """The integral of a large white image exceeds 32 bits, the sums over boxes do not."""
    white = np.full((3000, 3000), 255, np.uint8)
    assert BoxSums(white, 2).sums(-5, -5, 11, 11, 2, 1490, (1, 1))[0, 0] == 255 * 121


def test_blobs_are_the_maxima_of_the_determinant():
    """Each blob is next to a maximum among 26 neighbours found by a loop, with its response."""
    grey, threshold = noise(3), 1e-5
    sizes = filter_sizes(0, 3)
    layers = np.array([[[
        determinant_by_summation(grey, row, column, size)
        if min(row, column, 60 - row, 73 - column) >= size // 2 else 0.0
        for column in range(74)] for row in range(61)] for size in sizes])
    maxima = {}
    for row in range(10, 51):
        for column in range(10, 64):
            cube = layers[:, row - 1:row + 2, column - 1:column + 2]
            if cube[1, 1, 1] > threshold and cube[1, 1, 1] == cube.max():
                maxima[column, row] = cube[1, 1, 1]
    found = find_blobs(grey, 1, 3, 1, threshold)
    assert len(found.sizes) > 10
    at_maximum = np.array(sorted(maxima))
    for pixel, response in zip(found.pixels, found.responses):
        close = at_maximum[np.abs(at_maximum - pixel).max(axis=1) <= 0.76]
        assert any(maxima[tuple(node)] == pytest.approx(response, rel=1e-3) for node in close)
    assert len(found.sizes) > 0.6 * len(maxima)  # the vertices of the others are too far away


@pytest.mark.parametrize('sigma', [3.0, 6.0, 12.0, 24.0])
@pytest.mark.parametrize('offset', [(0.0, 0.0), (1.0, 1.0), (0.3, 0.7), (-0.5, 1.4)])
def test_a_round_blob_is_found_at_its_centre(sigma, offset):
    centre = np.array([160.0, 120.0]) + offset
    found = find_blobs(blob(centre, sigma), 4, 5, 2, 1e-5)
    nearest = np.argmin(np.linalg.norm(found.pixels - centre, axis=1))
    np.testing.assert_allclose(found.pixels[nearest], centre, atol=0.02 * sigma + 0.15)


def test_sizes_grow_with_the_blob():
    sizes = []
    for sigma in (6.0, 9.0, 13.5, 20.25):
        found = find_blobs(blob((160.3, 120.6), sigma), 5, 5, 2, 1e-5)
        sizes.append(found.sizes[np.argmin(np.linalg.norm(found.pixels - (160.3, 120.6), axis=1))])
    np.testing.assert_allclose(np.divide(sizes[1:], sizes[:-1]), 1.5, atol=0.15)


def test_blobs_are_rarely_found_twice():
    """Layers of one octave are searched in the next one too."""
    found = find_blobs(noise(7, 240, 320), 5, 5, 2, 1e-5)
    distances = np.linalg.norm(found.pixels[:, None] - found.pixels, axis=2)
    same_size = np.abs(np.log(found.sizes[:, None] / found.sizes)) < 0.05
    assert np.count_nonzero((distances < 1.0) & same_size) <= 1.01 * len(found.sizes)


@pytest.mark.parametrize('shape', [(1, 1), (8, 300), (20, 20), (21, 21), (40, 16)])
def test_small_images_have_few_blobs_or_none(shape):
    assert len(find_blobs(noise(0, *shape), 5, 5, 2, 0.0).sizes) < 20


def test_the_strongest_blobs_of_an_independent_implementation_are_found():
    """
    The strongest keypoints of mahotas have one of ours within 1.5 px, with the same response.

    mahotas 1.4 applies the interpolated offset with the wrong sign (a round blob 0.3 px right of a
    sample is reported 0.3 px left of it), so its positions are accurate to a sample only: a
    sampling step of one pixel is used.
    """
    surf = pytest.importorskip('mahotas.features.surf')
    grey = SyntheticSource(SyntheticOptions(seed=3, frames=1)).frame(0).grey
    theirs = surf.interest_points(grey, 4, 5, 1, threshold=1e-5 * 255 ** 2)
    theirs = theirs[np.argsort(-theirs[:, 3])][:200]
    ours = find_blobs(grey, 4, 5, 1, 1e-5)
    distances = np.linalg.norm(theirs[:, None, 1::-1] - ours.pixels, axis=2)
    found = distances.min(axis=1) < 1.5
    assert found.mean() > 0.7
    ratio = ours.responses[distances.argmin(axis=1)] * 255 ** 2 / theirs[:, 3]
    assert np.median(ratio[found]) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize('octaves, largest', [(1, 33), (2, 63), (3, 123)])
def test_octaves_end_the_sizes_of_blobs(octaves, largest):
    """Of five filters the largest has no maxima: 33, 63, 123 are those before it."""
    found = find_blobs(noise(5, 400, 500), octaves, 5, 2, 0.0)
    growth = 6 << (octaves - 1)
    assert largest - 1.5 * growth < found.sizes.max() <= largest + 0.75 * growth
    assert found.sizes.min() >= 15 - 0.75 * 6


@pytest.mark.parametrize('threshold', [1e-5, 1e-4, 1e-3])
def test_responses_exceed_the_threshold(threshold):
    grey = noise(6, 200, 300)
    found, all_found = (find_blobs(grey, 3, 5, 1, limit) for limit in (threshold, 0.0))
    assert found.responses.min() > threshold
    assert len(found.responses) == np.sum(all_found.responses > threshold)


def test_no_blob_is_further_from_its_sample_than_three_quarters():
    """Steps are of one pixel, so that positions within 0.25 px of half a pixel are in between."""
    found = find_blobs(noise(7, 200, 300), 1, 5, 1, 0.0)
    offsets = np.abs(found.pixels - np.rint(found.pixels))
    assert len(found.sizes) > 100 and offsets.max() <= 0.5
    steps = (found.sizes - 15) / 6
    assert np.abs(steps - np.clip(np.rint(steps), 0, 2)).max() <= 0.75


@pytest.mark.parametrize('size, count', [(20, 0), (21, 1), (60, 1)])
def test_a_blob_in_an_image_as_large_as_its_filters(size, count):
    """The third filter, of side 21, must fit for maxima of the second one."""
    middle = (size - 1) / 2
    found = find_blobs(blob((middle, middle), 2.4, (size, size)), 1, 3, 1, 1e-4)
    assert len(found.sizes) == count


def test_of_two_equal_neighbours_one_counts():
    """A blob exactly between two samples."""
    found = find_blobs(blob((100.5, 80.0), 2.4, (200, 160)), 1, 5, 1, 1e-3)
    near = np.linalg.norm(found.pixels - (100.5, 80.0), axis=1) < 2.0
    assert near.sum() == 1
    np.testing.assert_allclose(found.pixels[near][0], (100.5, 80.0), atol=0.05)


def test_the_vertex_of_a_paraboloid_is_exact():
    """Central differences of a quadratic form have no error, those of its cross terms neither."""
    rng = np.random.default_rng(8)
    roots, vertices = rng.normal(size=(50, 3, 3)), rng.uniform(-1, 1, (50, 3))
    samples = np.stack(np.meshgrid(*3 * [(-1, 0, 1)], indexing='ij'), axis=-1).reshape(-1, 3)
    ways = samples[:, None] - vertices
    form = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(3)
    cube = 5.0 - np.einsum('kni,nij,knj->kn', ways, form, ways)
    np.testing.assert_allclose(_vertex(cube), vertices.T, atol=1e-9)
