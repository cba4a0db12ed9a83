# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs at the borders of the rule; test_pair_evaluation.py has it written down a second time."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_pairs import FramePair, countable_pairs
from aick_ros.geometry.trajectory import Trajectory

PERIOD = 40_000_000  # ns
ALLOWED = 20_000_000  # ns


def truth(start, end):
    """Return a ground truth at 100 Hz from one stamp to another."""
    stamps = np.arange(start, end + 1, 10_000_000)
    return Trajectory(stamps, np.tile(np.eye(4), (len(stamps), 1, 1)))


@pytest.mark.parametrize('error', [-ALLOWED - 1, -ALLOWED, 0, ALLOWED, ALLOWED + 1])
def test_an_interval_may_differ_by_20_ms(error):
    stamps = [0, PERIOD, 2 * PERIOD, 3 * PERIOD + error]
    stamps += [stamps[-1] + i * PERIOD for i in (1, 2, 3)]
    pairs = countable_pairs(stamps, truth(0, stamps[-1] + PERIOD), 1)
    irregular = [] if abs(error) <= ALLOWED else [2]
    assert [i for i in range(6) if FramePair(i, i + 1) not in pairs] == irregular
    assert {pair.gap for pair in pairs} == {1}


def test_both_frames_need_ground_truth():
    stamps = [i * PERIOD for i in range(8)]
    pairs = countable_pairs(stamps, truth(2 * PERIOD, 6 * PERIOD), 3)
    assert pairs == [(2, 5), (3, 6)]


@pytest.mark.parametrize('count', [0, 1, 2])
def test_few_frames_have_few_pairs(count):
    stamps = [i * PERIOD for i in range(count)]
    assert len(countable_pairs(stamps, truth(0, PERIOD), 1)) == max(0, count - 1)
    assert countable_pairs(stamps, truth(0, PERIOD), 2) == []
