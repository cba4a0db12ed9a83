# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Descriptor distances against plain loops."""

import numpy as np
import pytest

from aick_ros.features.descriptors import descriptor_distances, pair_distances, pairs_below


def plain_distance(a, b):
    """d_d of Eq. 1 for one pair of descriptors."""
    if a.dtype == np.uint8:
        return sum(bin(int(x) ^ int(y)).count('1') for x, y in zip(a, b)) / (8 * len(a))
    return sum((float(x) - float(y)) ** 2 for x, y in zip(a, b))


def random_descriptors(binary, width, counts):
    rng = np.random.default_rng(width)
    if binary:
        return [rng.integers(0, 256, (count, width), dtype=np.uint8) for count in counts]
    return [rng.normal(0, 1, (count, width)).astype(np.float32) for count in counts]


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('width', [32, 61, 64])
@pytest.mark.parametrize('counts', [(7, 9), (130, 5), (1, 1)], ids=str)
def test_distances_of_all_pairs_and_of_given_pairs(binary, width, counts):
    source, target = random_descriptors(binary, width, counts)
    expected = np.float32([[plain_distance(a, b) for b in target] for a in source])
    np.testing.assert_allclose(descriptor_distances(source, target), expected, rtol=1e-4,
                               atol=1e-6)
    rows = np.random.default_rng(0).integers(0, counts, (3000, 2)).T
    np.testing.assert_allclose(pair_distances(source, target, *rows), expected[tuple(rows)],
                               rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('width', [1, 7, 32, 33])
@pytest.mark.parametrize('counts', [(90, 70), (3, 16), (17, 1)], ids=str)
def test_pairs_below_a_bound_are_all_and_in_order(binary, width, counts):
    """The bound is one of the distances: that pair is not below it."""
    source, target = random_descriptors(binary, width, counts)
    distances = descriptor_distances(source, target)
    for bound in np.quantile(distances, [0.0, 0.05, 0.5, 1.0], method='nearest'):
        rows, found = pairs_below(source, target, float(bound))
        np.testing.assert_array_equal(rows, np.nonzero(distances < bound))
        np.testing.assert_array_equal(found, distances[distances < bound])


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
def test_distances_of_identical_descriptors_are_small_and_never_negative(binary):
    """Rounding makes |a|^2 + |b|^2 - 2ab of equal floats negative now and then."""
    source, = random_descriptors(binary, 64, [2000])
    rows = np.arange(len(source))
    of_pairs = pair_distances(source, source.copy(), rows, rows)
    of_all = np.diagonal(descriptor_distances(source, source.copy()))
    for distances in (of_pairs, of_all):
        assert distances.min() >= 0.0
        assert distances.max() < 1e-4


def test_distances_of_descriptors_that_differ_in_the_last_bit_are_never_negative():
    source, = random_descriptors(False, 64, [2000])
    target, rows = np.nextafter(source, np.float32(1)), np.arange(len(source))
    assert pair_distances(source, target, rows, rows).min() == 0.0
    assert descriptor_distances(source, target).min() == 0.0


def test_complementary_bits_have_distance_one():
    source, target = np.zeros((2, 32), np.uint8), np.full((3, 32), 255, np.uint8)
    np.testing.assert_array_equal(descriptor_distances(source, target), np.ones((2, 3)))


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('counts', [(0, 4), (4, 0), (0, 0)], ids=str)
def test_empty_input_gives_empty_distances(binary, counts):
    source, target = random_descriptors(binary, 32, counts)
    assert descriptor_distances(source, target).shape == counts
    none = np.empty(0, np.intp)
    assert pair_distances(source, target, none, none).shape == (0,)
    rows, distances = pairs_below(source, target, 1.0)
    assert (rows.shape, distances.shape) == ((2, 0), (0,))


def test_views_of_other_arrays_have_the_distances_of_copies():
    wide, rows = random_descriptors(True, 64, [8])[0], np.array([[0, 5], [7, 2]])
    view = wide[::2, 16:48]
    np.testing.assert_array_equal(descriptor_distances(view, wide[:, ::2]),
                                  descriptor_distances(view.copy(), wide[:, ::2].copy()))
    np.testing.assert_array_equal(pair_distances(wide, wide, *rows.T),
                                  pair_distances(wide, wide, [0, 7], [5, 2]))


@pytest.mark.parametrize('row', [-1, 4])
@pytest.mark.parametrize('is_source', [True, False])
def test_rows_beyond_the_descriptors_are_rejected(row, is_source):
    source = target = np.zeros((4, 32), np.uint8)
    rows = np.array([[0, row] if is_source else [0, 0], [0, 0] if is_source else [0, row]])
    with pytest.raises(ValueError, match='^a row of a pair is not one of the descriptors$'):
        pair_distances(source, target, *rows)


def test_binary_descriptors_of_two_widths_or_types_are_rejected():
    source = np.zeros((4, 32), np.uint8)
    for other, error in ((np.zeros((4, 31), np.uint8), ValueError),
                         (np.zeros((4, 32), np.int8), TypeError),
                         (np.zeros((0, 32), np.float32), TypeError)):
        for compared in (lambda: descriptor_distances(source, other),
                         lambda: pairs_below(source, other, 0.5),
                         lambda: pair_distances(source, other, *np.zeros((2, 1), np.int64))):
            with pytest.raises(error, match='the target'):
                compared()
