# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Pairs of frames at a fixed gap, and the one rule of which pairs count.

A pair counts if the ground truth has the poses of both frames and no frame is missing between
them. ``aick evaluate`` and ``aick benchmark`` share this rule.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

MAX_INTERVAL_ERROR = 0.02  # chosen: below one period at 30 Hz, above its jitter
"""Largest difference [s] between the interval of a pair and gap times the median period."""


class FramePair(NamedTuple):
    """Two frames, by their index in the list of frames; the target is the earlier one."""

    target: int
    source: int

    @property
    def gap(self) -> int:
        """Distance of the two frames in the list of frames."""
        return self.source - self.target


def median_period(stamps: Sequence[int]) -> float:
    """Return the median time between consecutive frames [ns]; at least 2 stamps are required."""
    return float(np.median(np.diff(stamps)))


def countable_pairs(stamps: Sequence[int], ground_truth: Trajectory, gap: int) -> list[FramePair]:
    """
    Return the pairs of a gap that count, in the order of the frames.

    :param stamps: of all frames [ns].
    :param gap: 1 or more.
    """
    if len(stamps) < 2:
        return []
    interval = gap * median_period(stamps)
    covered = [true_pose(ground_truth, stamp) is not None for stamp in stamps]
    pairs = (FramePair(i, i + gap) for i in range(len(stamps) - gap))
    return [pair for pair in pairs if covered[pair.target] and covered[pair.source]
            and abs(stamps[pair.source] - stamps[pair.target] - interval)
            <= MAX_INTERVAL_ERROR * NANOSECONDS]
