# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The recordings of a benchmark, and the pairs of frames that every method is given."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.pairs import MAX_HOLE, MAX_INTERVAL_ERROR
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources import OnDamaged, RgbdSource, SourceOptions, open_source


class Pair(NamedTuple):
    """Two frames, by their place in the list of frames; the target is the earlier one."""

    target: int
    source: int

    @property
    def gap(self) -> int:
        """How many frames they are apart."""
        return self.source - self.target


@dataclass(frozen=True)
class Request:
    """
    What to read; goes to other processes as JSON.

    :param path: as :func:`aick_ros.sources.open_source` takes it.
    :param limit: most frames; None: all.
    """

    path: str
    limit: int | None = None
    max_interval: float = SourceOptions.max_interval

    def open(self) -> RgbdSource:
        """Return the source."""
        return open_source(self.path, SourceOptions(max_interval=self.max_interval))

    def to_json(self) -> dict[str, Any]:
        """Return what ``Request(**...)`` makes a request of again."""
        return dataclasses.asdict(self)


@dataclass(frozen=True, eq=False)
class Recording:
    """
    A recording with ground truth that has been looked through.

    :param stamps: of all frames that can be read [ns].
    """

    name: str
    request: Request
    stamps: tuple[int, ...]
    ground_truth: Trajectory

    @classmethod
    def scan(cls, request: Request, on_progress: Callable[[int], None],
             on_damaged: OnDamaged) -> Recording:
        """
        Read a source for its stamps.

        :raises InputError: where it has no ground truth, or no two frames.
        """
        source = request.open()
        if source.ground_truth is None:
            raise InputError(f'{source.name} has no ground truth: without it no method can be '
                             'judged; leave it out')
        stamps = []
        for frame in islice(source.frames(on_damaged), request.limit):
            stamps.append(frame.stamp)
            on_progress(len(stamps))
        if len(stamps) < 2:
            raise InputError(f'{source.name} has {len(stamps)} frames that can be used: a pair '
                             'takes two')
        return cls(source.name, request, tuple(stamps), source.ground_truth)

    @property
    def period(self) -> float:
        """The median time between two frames [ns]."""
        return float(np.median(np.diff(self.stamps)))

    def pairs(self, gaps: Sequence[int], most: int | None = None) -> list[Pair]:
        """
        Return the pairs that count, by the rules of :mod:`aick_ros.evaluation.scores.pairs`.

        :param most: of each gap; so many are taken evenly from all. None: all.
        """
        known = [self.ground_truth.at(stamp, MAX_HOLE) is not None for stamp in self.stamps]
        chosen = []
        for gap in gaps:
            pairs = [Pair(i, i + gap) for i in range(len(self.stamps) - gap)
                     if known[i] and known[i + gap] and self._is_regular(i, gap)]
            if most is not None and len(pairs) > most:
                places = np.linspace(0, len(pairs) - 1, most).round().astype(int)
                pairs = [pairs[place] for place in places]
            chosen += pairs
        return chosen

    def interval(self, pair: Pair) -> int:
        """Return the time between the frames of a pair [ns]."""
        return self.stamps[pair.source] - self.stamps[pair.target]

    def error(self, pair: Pair, T_target_source: np.ndarray) -> tuple[float, float]:
        """Return how far a transform is off: translation [m] and rotation [rad] of Eq. 3."""
        T_world_target, T_world_source = (
            self.ground_truth.at(self.stamps[index], MAX_HOLE) for index in pair)
        error = se3.inverse(T_world_source) @ T_world_target @ T_target_source
        return float(np.linalg.norm(error[:3, 3])), se3.angle(error[:3, :3])

    def _is_regular(self, target: int, gap: int) -> bool:
        interval = self.interval(Pair(target, target + gap))
        return abs(interval - gap * self.period) <= MAX_INTERVAL_ERROR * NANOSECONDS
