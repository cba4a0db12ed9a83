# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A power law is recovered from samples drawn from it."""

import dataclasses

import numpy as np
import pytest

from aick_ros.evaluation.noise.noise_law import MIN_SAMPLES, Bin, bins_of, fit_law
from aick_ros.settings.parameter import Parameter

EXPONENT = Parameter('a.power', float, 1.5, 'A power.', minimum=0.0, maximum=4.0)


def samples(x, scale, exponent, count=100):
    """Return x, and standard deviations whose median at each x is that of the law."""
    x = np.repeat(x, count)
    factors = np.tile(np.linspace(0.5, 1.5, count), len(x) // count)
    return x, scale * x ** exponent * factors


@pytest.mark.parametrize('scale, exponent', [(0.5, 0.0), (0.002, 2.0), (3.0, 0.7)])
def test_a_law_is_found(scale, exponent):
    bins = bins_of(*samples(np.geomspace(0.5, 4.0, 13), scale, exponent))
    law = fit_law(bins, 1.5, EXPONENT)
    assert law.exponent_estimated
    assert law.exponent == pytest.approx(exponent, abs=1e-6)
    assert law.scale == pytest.approx(scale, rel=1e-6)
    assert law.at(2.0) == pytest.approx(scale * 2.0 ** exponent, rel=1e-6)
    assert [bin_.count for bin_ in bins] == [100] * 13


def test_a_bin_is_the_middle_of_its_samples():
    rng = np.random.default_rng(0)
    x, sigmas = rng.uniform(0.95, 1.05, 501), rng.uniform(0, 1, 501)
    (found,) = bins_of(x, sigmas)
    assert found.at == pytest.approx(np.exp(np.mean(np.log(x))))
    assert found.sigma == np.sort(sigmas)[250]
    assert bins_of(x[:MIN_SAMPLES - 1], sigmas[:MIN_SAMPLES - 1]) == []


def test_a_bin_is_a_quarter_of_an_octave_with_enough_samples():
    x = np.repeat(2.0 ** (np.arange(-4, 5) / 4), MIN_SAMPLES)
    assert [bin_.count for bin_ in bins_of(x, x)] == [MIN_SAMPLES] * 9
    np.testing.assert_allclose([(bin_.at, bin_.sigma) for bin_ in bins_of(x, 2 * x)],
                               np.unique(x)[:, None] * [1.0, 2.0])
    around = np.r_[x * 2.0 ** 0.12, x * 2.0 ** -0.12]
    assert [bin_.count for bin_ in bins_of(around, around)] == [2 * MIN_SAMPLES] * 9


def test_the_exponent_is_kept_where_the_range_is_small():
    law = fit_law(bins_of(*samples(np.geomspace(1.0, 1.6, 4), 0.1, 0.0)), 1.5, EXPONENT)
    assert (law.exponent, law.exponent_estimated) == (1.5, False)
    assert law.at(1.25) == pytest.approx(0.1, rel=0.1)


def test_the_exponent_keeps_to_its_range():
    narrow = dataclasses.replace(EXPONENT, maximum=1.0, default=0.5)
    law = fit_law(bins_of(*samples(np.geomspace(0.5, 4.0, 13), 0.1, 2.0)), 0.5, narrow)
    assert (law.exponent, law.exponent_estimated) == (1.0, True)


@pytest.mark.parametrize('count, span, is_estimated', [
    (4, 2.0, True), (4, 1.99, False), (3, 4.0, False)])
def test_an_octave_and_four_bins_determine_the_exponent(count, span, is_estimated):
    bins = [Bin(at, 100, 0.1 * at ** 0.5) for at in np.linspace(1.0, span, count)]
    law = fit_law(bins, 1.5, EXPONENT)
    assert law.exponent_estimated is is_estimated
    assert law.exponent == pytest.approx(0.5 if is_estimated else 1.5)


def test_a_bin_counts_by_its_samples_up_to_three_hundred():
    def scale(count):
        return fit_law([Bin(1.0, 300, 0.1), Bin(1.0, count, 0.4)], 0.0, EXPONENT).scale
    assert scale(30) < scale(150) < scale(300) == scale(30_000)
    assert 0.1 < scale(30) < 0.13 < scale(300) < 0.4
