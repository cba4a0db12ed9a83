# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Smooth functions of time that seem random, known at any time without the time before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


class Wander:
    """
    A sum of sine waves.

    :param amplitude: the value never exceeds it.
    :param bands: of each wave its share of the amplitude and the frequencies [Hz] from which and
        to which its own is drawn.
    """

    def __init__(self, rng: np.random.Generator, amplitude: float,
                 bands: Sequence[tuple[float, float, float]]) -> None:
        shares, lows, highs = np.transpose(bands)
        self._amplitudes = amplitude * shares / shares.sum()
        self._turn_rates = 2 * np.pi * rng.uniform(lows, highs)
        self._phases = rng.uniform(0, 2 * np.pi, len(shares))

    def at(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(self._amplitudes @ np.sin(self._turn_rates * time + self._phases))
