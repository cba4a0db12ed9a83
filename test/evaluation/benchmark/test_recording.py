# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings that a benchmark can use, and the choice of their frame pairs."""

import dataclasses

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.sources import raise_damage


def scan(request, limit, on_progress=lambda done: None):
    return Recording.scan(dataclasses.replace(request, limit=limit), on_progress, raise_damage)


def test_a_recording_of_a_single_frame_has_no_pair(recording):
    seen = []
    assert scan(recording.request, 2, seen.append).stamps == recording.stamps[:2]
    assert seen == [1, 2]
    with pytest.raises(InputError, match='rendered has 1 usable frames: at least 2 are required'):
        scan(recording.request, 1)


def test_a_limited_number_of_pairs_is_evenly_spaced(recording):
    pairs = recording.pairs((1, 3), most=3)
    assert [pair.target for pair in pairs if pair.gap == 1] == [0, 3, 6]
    assert [pair.target for pair in pairs if pair.gap == 3] == [0, 2, 4]
