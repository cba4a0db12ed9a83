# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Counts, rates and delays of frames."""

import numpy as np
import pytest

from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count


def test_rates_shares_and_medians_are_those_of_the_window(frames):
    frames.answer(900, Status.TOO_FEW_MATCHES, matches=3, total=99.0)
    frames.answer(301)
    snapshot = frames.snapshot()
    assert snapshot.rate(Count.RECEIVED) == pytest.approx(30, rel=0.01)
    assert snapshot.share(Count.LOST, Count.ANSWERED) < 0.01
    assert (snapshot.inliers, snapshot.timing) == (100, {'total': 20.0})
    assert np.median(snapshot.delays) == pytest.approx(10.5, abs=0.5)
    assert np.median(snapshot.ages) == pytest.approx(50.5, abs=0.5)
    assert snapshot.totals[Count.LOST] == 900
    assert snapshot.totals[Count.ANSWERED] == 1201


def test_a_rate_in_the_first_seconds_is_that_since_the_start(frames):
    frames.answer(60)
    assert frames.snapshot().rate(Count.ANSWERED) == pytest.approx(30, rel=0.05)


def test_counts_from_elsewhere_enter_the_window_as_they_grow(frames):
    frames.count_up_to(Count.DROPPED_UNDER_LOAD, 5)
    frames.now += 100
    frames.count_up_to(Count.DROPPED_UNDER_LOAD, 7)
    snapshot = frames.snapshot()
    assert snapshot.totals[Count.DROPPED_UNDER_LOAD] == 7
    assert snapshot.recent[Count.DROPPED_UNDER_LOAD] == 2


def test_a_frame_whose_stamp_is_not_newer_is_no_answer(frames):
    frames.answer(3)
    frames.answer(1, Status.BAD_STAMP)
    snapshot = frames.snapshot()
    assert (snapshot.totals[Count.ANSWERED], snapshot.totals[Count.STAMP_NOT_NEWER]) == (3, 1)
    assert snapshot.status is Status.OK
    assert snapshot.silent_for == pytest.approx(1 / 30)


def test_a_lost_camera_is_not_silent(frames):
    """Frames of a lost camera are answered, too."""
    frames.answer(30)
    frames.answer(300, Status.TOO_FEW_MATCHES)
    frames.now += 1.0
    snapshot = frames.snapshot()
    assert snapshot.silent_for == pytest.approx(1.0)
    assert snapshot.lost_for == pytest.approx(11.0)


def test_silence_before_the_first_answer_counts_from_the_start(frames):
    frames.now += 3.0
    assert frames.snapshot().silent_for == pytest.approx(3.0)


def test_a_damaged_frame_does_not_end_a_loss(frames):
    frames.answer(30)
    frames.answer(60, Status.TOO_FEW_MATCHES)
    frames.damage(1)
    assert frames.snapshot().lost_for == pytest.approx(61 / 30)
    frames.answer(1)
    assert frames.snapshot().lost_for == 0.0


def test_a_damaged_frame_does_not_lose_a_tracked_camera(frames):
    frames.answer(30)
    frames.damage(30)
    assert frames.snapshot().lost_for == 0.0


def test_restarted_it_knows_nothing_of_before(frames):
    frames.answer(30)
    frames.answer(60, Status.TOO_FEW_MATCHES)
    frames.now += 100.0
    frames.restart()
    frames.now += 2.0
    snapshot = frames.snapshot()
    assert not snapshot.totals
    assert (snapshot.status, snapshot.lost_for) == (Status.NO_FRAME, 0.0)
    assert snapshot.silent_for == pytest.approx(2.0)
    assert len(snapshot.delays) == 0
