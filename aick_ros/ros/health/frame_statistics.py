# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What became of the frames, in all and lately."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.status import Status

WINDOW = 10.0
"""How long lately is [s]."""

RECEIVED, ANSWERED, LOST = 'frames received', 'frames answered', 'frames lost'
DAMAGED, FAILED = 'frames damaged', 'internal errors'
UNDER_LOAD, LATE = 'frames dropped under load', 'frames whose stamp repeats or goes back'

_MOST_KEPT = 10_000  # a flood of messages must not fill the memory


@dataclass(frozen=True)
class Snapshot:
    """
    Counts and times at one moment.

    :param totals: since the start, by name; ``recent`` lately.
    :param span: how long lately is by now [s].
    :param status: of the last frame, with ``reason``.
    :param lost_for: since the camera was last tracked, 0 where it is [s].
    :param silent_for: since a frame was last answered, or since the start [s].
    :param delays: of the answers lately, from pairing to publishing [ms]; ``ages`` from the
        stamp of the image, by the clock of ROS.
    :param inliers: keypoints that agree with the motion, median lately.
    :param timing: median milliseconds of each stage lately.
    """

    totals: Mapping[str, int]
    recent: Mapping[str, int]
    span: float
    status: Status
    reason: str
    lost_for: float
    silent_for: float
    delays: np.ndarray
    ages: np.ndarray
    inliers: float
    timing: Mapping[str, float]

    def rate(self, name: str) -> float:
        """Return how many a second there were lately."""
        return self.recent[name] / self.span

    def share(self, name: str, of: str) -> float:
        """Return the share of one count in another lately, 0 where there is none."""
        return self.recent[name] / max(self.recent[of], 1)


class _Answer(NamedTuple):
    at: float
    delay_ms: float
    age_ms: float
    inliers: int
    timing: dict[str, float]


class FrameStatistics:
    """
    Counts frames on any thread.

    :param clock: steady [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._totals: Counter[str] = Counter()
        self._events: deque[tuple[float, str, int]] = deque(maxlen=_MOST_KEPT)
        self._answers: deque[_Answer] = deque(maxlen=_MOST_KEPT)
        self._status, self._reason = Status.NO_FRAME, 'waiting for images'
        self._start = self._tracked_at = self._answered_at = clock()

    def count(self, name: str, number: int = 1) -> None:
        """Count so many of something, under its plain name."""
        with self._lock:
            self._count(name, number)

    def count_up_to(self, name: str, total: int) -> None:
        """Take over what is counted elsewhere."""
        with self._lock:
            self._count(name, total - self._totals[name])

    def answered(self, update: OdometryUpdate, delay_ms: float, age_ms: float) -> None:
        """Take note of an answer and the time since its images were paired, and were taken."""
        with self._lock:
            now = self._clock()
            if update.status is Status.BAD_STAMP:
                self._count(LATE, 1)
                return
            self._count(ANSWERED, 1)
            self._count(LOST, int(not update.status.ok))
            self._answers.append(_Answer(
                now, delay_ms, age_ms, update.support, update.timing))
            self._status, self._reason = update.status, update.reason
            self._answered_at = now
            if update.status.ok:
                self._tracked_at = now

    def damaged(self, reason: str, name: str = DAMAGED) -> None:
        """Take note of a frame that could not be used."""
        with self._lock:
            self._count(name, 1)
            self._status, self._reason = Status.BAD_FRAME, reason

    def snapshot(self) -> Snapshot:
        """Return the counts and times by now."""
        with self._lock:
            now = self._clock()
            for old in (self._events, self._answers):
                while old and old[0][0] < now - WINDOW:
                    old.popleft()
            recent: Counter[str] = Counter()
            for _, name, number in self._events:
                recent[name] += number
            lost = self._status not in (Status.NO_FRAME, Status.BAD_FRAME) and not self._status.ok
            return Snapshot(
                Counter(self._totals), recent, min(WINDOW, max(now - self._start, 1e-3)),
                self._status, self._reason, now - self._tracked_at if lost else 0.0,
                now - self._answered_at, np.array([answer.delay_ms for answer in self._answers]),
                np.array([answer.age_ms for answer in self._answers]),
                float(np.median([answer.inliers for answer in self._answers] or [0])),
                _medians([answer.timing for answer in self._answers]))

    def _count(self, name: str, number: int) -> None:
        self._totals[name] += number
        if number:
            self._events.append((self._clock(), name, number))


def _medians(timings: list[dict[str, float]]) -> dict[str, float]:
    stages = dict.fromkeys(stage for timing in timings for stage in timing)
    return {stage: float(np.median([timing[stage] for timing in timings if stage in timing]))
            for stage in stages}
