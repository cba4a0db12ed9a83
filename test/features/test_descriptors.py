# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Descriptor distances against plain loops, with the bit counting of NumPy 2 and without."""

import numpy as np
import pytest

from aick_ros.features import descriptors
from aick_ros.features.descriptors import descriptor_distances, pair_distances


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


@pytest.fixture(params=['counting bits', 'without'])
def numpy_version(request, monkeypatch):
    """NumPy 1 has no bitwise_count; the fallback must give the same."""
    if request.param == 'without':
        monkeypatch.setattr(descriptors, '_bit_counts', descriptors._look_up_bit_counts)
        monkeypatch.delattr(np, 'bitwise_count', raising=False)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('width', [32, 61, 64])
@pytest.mark.parametrize('counts', [(7, 9), (130, 5), (1, 1)], ids=str)
def test_distances_of_all_pairs_and_of_given_pairs(binary, width, counts, numpy_version):
    source, target = random_descriptors(binary, width, counts)
    expected = np.float32([[plain_distance(a, b) for b in target] for a in source])
    np.testing.assert_allclose(descriptor_distances(source, target), expected, rtol=1e-4,
                               atol=1e-6)
    rows = np.random.default_rng(0).integers(0, counts, (3000, 2)).T
    np.testing.assert_allclose(pair_distances(source, target, *rows), expected[tuple(rows)],
                               rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
def test_distances_of_identical_descriptors_are_small_and_never_negative(binary, numpy_version):
    """Rounding makes |a|^2 + |b|^2 - 2ab of equal floats negative now and then."""
    source, = random_descriptors(binary, 64, [2000])
    rows = np.arange(len(source))
    of_pairs = pair_distances(source, source.copy(), rows, rows)
    of_all = np.diagonal(descriptor_distances(source, source.copy()))
    for distances in (of_pairs, of_all):
        assert distances.min() >= 0.0
        assert distances.max() < 1e-4


def test_distances_of_descriptors_that_differ_in_the_last_bit_are_never_negative(numpy_version):
    source, = random_descriptors(False, 64, [2000])
    target, rows = np.nextafter(source, np.float32(1)), np.arange(len(source))
    assert pair_distances(source, target, rows, rows).min() == 0.0
    assert descriptor_distances(source, target).min() == 0.0


def test_complementary_bits_have_distance_one(numpy_version):
    source, target = np.zeros((2, 32), np.uint8), np.full((3, 32), 255, np.uint8)
    np.testing.assert_array_equal(descriptor_distances(source, target), np.ones((2, 3)))


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('counts', [(0, 4), (4, 0), (0, 0)], ids=str)
def test_empty_input_gives_empty_distances(binary, counts, numpy_version):
    source, target = random_descriptors(binary, 32, counts)
    assert descriptor_distances(source, target).shape == counts
    none = np.empty(0, np.intp)
    assert pair_distances(source, target, none, none).shape == (0,)
