# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics of lists that are short, empty or not finite."""

import statistics

import pytest

from aick_ros.evaluation.scores.statistics import Percentiles, mean, median, root_mean_square

NUMBERS = [3.0, -1.0, 4.5, 1.0, 5.25]


def test_agrees_with_the_standard_library():
    assert mean(NUMBERS) == pytest.approx(statistics.mean(NUMBERS))
    assert median(NUMBERS) == statistics.median(NUMBERS)
    assert median(NUMBERS[:4]) == statistics.median(NUMBERS[:4])
    assert root_mean_square(NUMBERS) == pytest.approx(
        statistics.mean(x * x for x in NUMBERS) ** 0.5)
    assert Percentiles.of(range(101)) == Percentiles(50.0, 99.0)


def test_empty_lists_have_no_statistics():
    assert mean([]) is None
    assert median([]) is None
    assert root_mean_square([]) is None
    assert Percentiles.of([]) == Percentiles(None, None)


@pytest.mark.parametrize('infinite, expected',
                         [(0, 2.5), (1, 3.0), (3, 4.0), (4, None), (9, None)])
def test_median_counts_infinite_errors(infinite, expected):
    assert median([1.0, 2.0, 3.0, 4.0] + infinite * [float('inf')]) == expected
