# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames skipped evenly, by their stamps."""

import numpy as np
import pytest

from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.ros.input.rate_limit import RateLimit


def admitted(rate, stamps):
    limit = RateLimit(rate)
    return [stamp for stamp in stamps if limit.admits(stamp)]


def stamps_at(rate, count, jitter=0.0):
    rng = np.random.default_rng(1)
    times = np.arange(count) / rate + rng.uniform(-jitter, jitter, count)
    return [10 ** 18 + round(1e9 * time) for time in times]


@pytest.mark.parametrize('camera, wanted', [(30, 10), (30, 15), (30, 20), (60, 7), (30, 29)])
def test_as_many_as_wanted_and_evenly(camera, wanted):
    stamps = stamps_at(camera, 10 * camera, jitter=0.002)
    kept = admitted(wanted, stamps)
    assert len(kept) == pytest.approx(10 * wanted, abs=1)
    assert max(np.diff(kept)) < 1e9 / wanted + 1e9 / camera + 5e6


@pytest.mark.parametrize('wanted', [0, 30, 100])
def test_a_camera_that_is_not_too_fast_loses_nothing(wanted):
    stamps = stamps_at(30, 300, jitter=0.002)
    assert admitted(wanted, stamps) == stamps


@pytest.mark.parametrize('wanted', [1e-300, 5e-324])
def test_at_a_rate_of_almost_none_there_is_one(wanted):
    assert len(admitted(wanted, stamps_at(30, 300))) == 1


def test_after_a_pause_there_is_no_burst():
    before, after = stamps_at(30, 30), [s + 10 ** 11 for s in stamps_at(30, 30)]
    assert len(admitted(10, before + after)) <= 21


def test_a_recording_that_starts_again_is_not_waited_for():
    stamps = stamps_at(30, 300)
    assert len(admitted(10, stamps + stamps)) == pytest.approx(200, abs=2)


SECOND = 10 ** 9


@pytest.mark.parametrize('after, is_admitted', [
    (SECOND * 9 // 10, True), (SECOND * 9 // 10 - 1, False), (SECOND, True)])
def test_a_frame_may_come_a_tenth_of_a_period_early(after, is_admitted):
    stamps = [10 * SECOND, 10 * SECOND + after]
    assert admitted(1, stamps) == stamps[:1 + is_admitted]


@pytest.mark.parametrize('back, is_admitted', [
    (1, False), (SECOND // 2, False), (RESTART_AFTER, False), (RESTART_AFTER + 1, True)])
def test_only_stamps_that_go_back_by_more_than_a_second_are_of_another_recording(
        back, is_admitted):
    """Less is an image that is late; it must not bring the next one forward."""
    start = 10 * SECOND
    stamps = [start, start - back, start - back + SECOND]
    assert admitted(2, stamps)[1:] == ([start - back, start - back + SECOND] if is_admitted else [
        stamp for stamp in stamps[2:] if stamp >= start + SECOND * 45 // 100])


def test_without_a_limit_every_frame_is_admitted_in_any_order():
    stamps = [10 * SECOND, 10 * SECOND, 9 * SECOND, 0]
    assert admitted(0, stamps) == stamps
