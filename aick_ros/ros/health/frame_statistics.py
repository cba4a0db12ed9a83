# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Counts and delays of frames, since the start and over the last seconds."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aick_ros.frames.repetition import Repeat
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count

WINDOW = 10.0
"""Length of the window for rates and shares [s]; chosen."""

_MOST_KEPT = 10_000  # events; chosen to bound the memory in a flood of messages


@dataclass(frozen=True)
class Snapshot:
    """
    Counts and times at one moment.

    :param totals: counts since the start; ``recent`` those of the window.
    :param span: length of the window so far [s].
    :param status: status of the last frame, with ``reason``.
    :param lost_for: time since the camera was last tracked, 0 while it is tracked [s].
    :param silent_for: time since a frame was last answered, or since the start [s].
    :param delays: from pairing to publishing, of each answer in the window [ms].
    :param ages: from the image stamp to publishing by the ROS clock, likewise [ms].
    :param inliers: median number of keypoints that agree with the motion.
    :param timing: median duration of each stage [ms].
    """

    totals: Counter[Count]
    recent: Counter[Count]
    span: float
    status: Status
    reason: str
    lost_for: float
    silent_for: float
    delays: np.ndarray
    ages: np.ndarray
    inliers: float
    timing: Mapping[str, float]

    def rate(self, count: Count) -> float:
        """Return the rate of a count in the window [Hz]."""
        return self.recent[count] / self.span

    def share(self, count: Count, of: Count) -> float:
        """Return the ratio of two counts in the window, 0 where the second is 0."""
        return self.recent[count] / max(self.recent[of], 1)


class _Answer(NamedTuple):
    """Measurements of one answered frame; ``at`` is the steady time [s]."""

    at: float
    delay_ms: float
    age_ms: float
    inliers: int
    timing: Mapping[str, float]


class _Event(NamedTuple):
    """An increment of a count; ``at`` is the steady time [s]."""

    at: float
    counted: Count
    number: int


class FrameStatistics:
    """
    Counts frames; safe to call from any thread.

    :param clock: steady clock [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self.restart()

    def restart(self) -> None:
        """Forget everything and begin now."""
        with self._lock:
            self._totals: Counter[Count] = Counter()
            self._events: deque[_Event] = deque(maxlen=_MOST_KEPT)
            self._answers: deque[_Answer] = deque(maxlen=_MOST_KEPT)
            self._status, self._reason = Status.NO_FRAME, 'waiting for images'
            self._is_lost = False
            self._start = self._tracked_at = self._answered_at = self._clock()

    def count(self, count: Count, number: int = 1) -> None:
        """Add to a count."""
        with self._lock:
            self._add(count, number)

    def count_up_to(self, count: Count, total: int) -> None:
        """Set a count to a total that is counted elsewhere."""
        with self._lock:
            self._add(count, total - self._totals[count])

    def dropped(self, total: int, while_waiting: bool) -> None:
        """
        Count frames dropped for newer ones.

        :param total: number of all of them until now.
        :param while_waiting: whether those since the last call were by late transforms.
        """
        under_load, waiting = Count.DROPPED_UNDER_LOAD, Count.DROPPED_WHILE_WAITING
        with self._lock:
            self._add(waiting if while_waiting else under_load,
                      total - self._totals[under_load] - self._totals[waiting])

    def answered(self, update: OdometryUpdate, delay_ms: float, age_ms: float) -> None:
        """
        Record an answered frame.

        :param delay_ms: time since its images were paired [ms].
        :param age_ms: time since the stamp of its colour image [ms].
        """
        with self._lock:
            now = self._clock()
            if update.status is Status.BAD_STAMP:
                self._add(Count.STAMP_NOT_NEWER, 1)
                return
            self._is_lost = update.status.is_lost
            self._add(Count.BY_DEPTH_ALONE, int(update.evidence is Evidence.DEPTH_ALONE))
            self._add(Count.BY_COLOUR_ALONE, int(update.evidence is Evidence.COLOUR_ALONE))
            self._add(Count.REPEATED, int(update.prepared.repeat is not Repeat.NONE))
            self._add(Count.ANSWERED, 1)
            self._add(Count.LOST, int(self._is_lost))
            self._answers.append(_Answer(
                now, delay_ms, age_ms, update.support, update.timing))
            self._status, self._reason = update.status, update.reason
            self._answered_at = now
            if not self._is_lost:
                self._tracked_at = now

    def damaged(self, reason: str, count: Count = Count.DAMAGED) -> None:
        """Record a frame that could not be used; whether the camera is lost does not change."""
        with self._lock:
            self._add(count, 1)
            self._status, self._reason = Status.BAD_FRAME, reason

    def snapshot(self) -> Snapshot:
        """Return the counts and times of this moment."""
        with self._lock:
            now = self._clock()
            while self._events and self._events[0].at < now - WINDOW:
                self._events.popleft()
            while self._answers and self._answers[0].at < now - WINDOW:
                self._answers.popleft()
            recent: Counter[Count] = Counter()
            for event in self._events:
                recent[event.counted] += event.number
            return Snapshot(
                Counter(self._totals), recent, min(WINDOW, max(now - self._start, 1e-3)),
                self._status, self._reason, now - self._tracked_at if self._is_lost else 0.0,
                now - self._answered_at, np.array([answer.delay_ms for answer in self._answers]),
                np.array([answer.age_ms for answer in self._answers]),
                float(np.median([answer.inliers for answer in self._answers] or [0])),
                _medians([answer.timing for answer in self._answers]))

    def _add(self, count: Count, number: int) -> None:
        self._totals[count] += number
        if number:
            self._events.append(_Event(self._clock(), count, number))


def _medians(timings: list[Mapping[str, float]]) -> dict[str, float]:
    stages = dict.fromkeys(stage for timing in timings for stage in timing)
    return {stage: float(np.median([timing[stage] for timing in timings if stage in timing]))
            for stage in stages}
