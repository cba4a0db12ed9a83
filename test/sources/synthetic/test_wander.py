# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sums of waves, found again in their values by least squares."""

import numpy as np
import pytest

from aick_ros.sources.synthetic.wander import Wander

TIMES = np.linspace(0, 40, 4001)


def amplitudes(values, frequencies):
    """Return the amplitudes of waves of some frequencies [Hz], and what they leave."""
    angles = 2 * np.pi * np.outer(TIMES, frequencies)
    waves = np.hstack([np.sin(angles), np.cos(angles)])
    found = np.linalg.lstsq(waves, values, rcond=None)[0]
    return np.hypot(*found.reshape(2, -1)), np.abs(values - waves @ found).max()


def test_each_wave_has_its_share_of_the_amplitude():
    wander = Wander(np.random.default_rng(0), 2.0, [(3.0, 0.4, 0.4), (1.0, 1.7, 1.7)])
    found, left = amplitudes([wander.at(time) for time in TIMES], [0.4, 1.7])
    np.testing.assert_allclose(found, [1.5, 0.5], rtol=1e-9)
    assert left < 1e-9


def test_frequencies_and_phases_are_drawn():
    rng = np.random.default_rng(1)
    peaks, starts = [], []
    for _ in range(40):
        wander = Wander(rng, 1.0, [(1.0, 0.5, 0.9)])
        values = np.array([wander.at(time) for time in TIMES])
        assert np.abs(values).max() <= 1.0
        peaks.append(np.fft.rfftfreq(len(TIMES), 0.01)[np.abs(np.fft.rfft(values)).argmax()])
        starts.append(values[0])
    assert 0.5 - 0.02 < min(peaks) < 0.6 < 0.8 < max(peaks) < 0.9 + 0.02
    assert min(starts) < -0.7 < 0.7 < max(starts)


@pytest.mark.parametrize('time', [-3.0, 0.0, 1e4])
def test_any_time_is_known_without_the_time_before(time):
    one, other = (Wander(np.random.default_rng(2), 1.0, [(1.0, 0.1, 0.3), (2.0, 1.0, 2.0)])
                  for _ in range(2))
    one.at(5.0)
    assert one.at(time) == other.at(time)
