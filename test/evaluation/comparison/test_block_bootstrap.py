# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bootstrap by blocks, by what is known of series whose values are correlated."""

import numpy as np
import pytest

from aick_ros.evaluation.comparison.block_bootstrap import REPLICATES, replicates_of_means

CORRELATION = 0.9
FRAMES = 4000


@pytest.fixture(scope='module')
def series():
    """Return a first-order autoregressive series of unit variance, 1xN."""
    rng = np.random.default_rng(5)
    values = [rng.normal()]
    for step in rng.normal(0, np.sqrt(1 - CORRELATION ** 2), FRAMES - 1):
        values.append(CORRELATION * values[-1] + step)
    return np.array([values])


def test_blocks_know_that_neighbours_are_alike(series):
    # the variance of the mean of such a series is (1 + a) / (1 - a) / N
    sigma = np.sqrt((1 + CORRELATION) / (1 - CORRELATION) / FRAMES)
    assert replicates_of_means(series, 100).std() == pytest.approx(sigma, rel=0.25)
    assert replicates_of_means(series, 1).std() == pytest.approx(1 / np.sqrt(FRAMES), rel=0.1)


def test_replicates_scatter_about_the_mean(series):
    means = replicates_of_means(series, 100)
    assert means.shape == (1, REPLICATES)
    assert means.mean() == pytest.approx(series.mean(), abs=4 * means.std() / REPLICATES ** 0.5)


def test_series_draw_the_same_blocks(series):
    first, second = replicates_of_means(np.vstack([series, 2 * series + 1]), 50)
    np.testing.assert_allclose(second, 2 * first + 1, atol=1e-9)


@pytest.mark.parametrize('frames', [1, 2, 5])
def test_short_series_have_means_of_their_values(frames):
    means = replicates_of_means(np.arange(frames, dtype=float)[None], 60)
    assert means.min() >= 0
    assert means.max() <= frames - 1


def test_blocks_are_at_most_a_quarter_of_the_series(series):
    """Longer ones would all be about the same frames."""
    short = series[:, :43]
    np.testing.assert_array_equal(replicates_of_means(short, 30), replicates_of_means(short, 10))
    assert replicates_of_means(short, 10).std() != replicates_of_means(short, 9).std()
