# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Lateness of the transforms that frames wait for, and a sentence about it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from aick_ros.borders.names import quoted
from aick_ros.ros.health.frame_statistics import WINDOW
from aick_ros.ros.health.sentences import joined

_LONG = 0.05  # seconds; chosen: a frame at 20 Hz, as most odometries publish
_TOLERATED = 0.05  # share of the waits that may be long; chosen
_FEWEST = 3  # long waits; chosen
_MOST_KEPT = 1000  # waits; chosen: of two cameras at 50 Hz


class _Wait(NamedTuple):
    """A wait for a transform; ``at`` is the steady time, ``seconds`` the lateness [s]."""

    at: float
    target: str
    source: str
    seconds: float


class Lateness:
    """
    Waits for transforms in the last 10 s, and the sentence where many were long or in vain.

    :param clock: steady clock [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waits: deque[_Wait] = deque(maxlen=_MOST_KEPT)

    def note(self, target: str, source: str, seconds: float) -> None:
        """
        Add a wait.

        :param seconds: its length, and the time that was still missing after it [s].
        """
        self._waits.append(_Wait(self._clock(), target, source, seconds))

    @property
    def complaint(self) -> str:
        """A sentence on each transform that arrives late and by how much, '' for none."""
        now = self._clock()
        while self._waits and self._waits[0].at < now - WINDOW:
            self._waits.popleft()
        frames = sorted({(wait.target, wait.source) for wait in self._waits})
        return joined(*(self._complaint_about(*names) for names in frames))

    def _complaint_about(self, target: str, source: str) -> str:
        seconds = np.array([wait.seconds for wait in self._waits
                            if (wait.target, wait.source) == (target, source)])
        long = seconds[seconds > _LONG]
        if len(long) < max(_FEWEST, _TOLERATED * len(seconds)):
            return ''
        return (f'the transform from {quoted(source)} to {quoted(target)} arrives '
                f'{np.median(long):.2f} s after the frames that need it, which wait up to '
                'wait_for_transform: publish it sooner and more often, and check that the clocks '
                'agree')
