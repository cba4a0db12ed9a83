# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that only one run has, counted and named."""

import pytest

from aick_ros.evaluation.comparison.frame_counts import FrameCounts, missing


def test_frames_are_counted_by_their_stamps():
    counts = FrameCounts.of(frozenset({1, 2, 3, 4}), frozenset({3, 4, 5}))
    assert (counts.baseline, counts.candidate, counts.common) == (4, 3, 2)
    assert (counts.lacking, counts.swapped.lacking) == (2, 1)
    assert counts.swapped == FrameCounts(3, 4, 2)


def test_what_lacks_nothing_has_no_sentence():
    assert missing({'desk': FrameCounts(5, 9, 5)}, [], 'a', 'b') == []


@pytest.mark.parametrize('most, names', [
    (None, '1 of 10 of r0, 2 of 10 of r1, 3 of 10 of r2'),
    (3, '1 of 10 of r0, 2 of 10 of r1, 3 of 10 of r2'),
    (2, '1 of 10 of r0, 2 of 10 of r1, and 1 more')])
def test_recordings_are_named_with_how_many_frames_they_lack(most, names):
    frames = {f'r{i}': FrameCounts(10, 9 - i, 9 - i) for i in range(3)}
    frames['whole'] = FrameCounts(10, 10, 10)
    assert missing(frames, ['hall', 'lab', 'yard'], 'a', 'b', most) == [
        f'b has no run of {"hall, lab, yard" if most != 2 else "hall, lab, and 1 more"}: '
        'not compared',
        f'b lacks frames that a has, {names}: only frames of both are compared']
