# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Stamps astray and images missing, counted by hand."""

import numpy as np
import pytest

from aick_ros.messages.stamp_monitor import StampMonitor

SECOND = 10 ** 9
START = 1_700_000_000 * SECOND


def astray(seconds, arrivals=None):
    """Return which of some stamps, after a start [s], are astray; they arrive when stamped."""
    watch = StampMonitor()
    return [watch.is_astray(START + round(stamp * SECOND), arrival)
            for stamp, arrival in zip(seconds, arrivals or seconds)]


def test_one_stamp_far_ahead_is_astray():
    assert astray([0.0, 0.1, 99.0, 0.3, 0.4], [0.0, 0.1, 0.2, 0.3, 0.4]) == [
        False, False, True, False, False]


def test_a_clock_set_forward_costs_one_image():
    assert astray([0.0, 0.1, 99.2, 99.3, 99.4], [0.0, 0.1, 0.2, 0.3, 0.4]) == [
        False, False, True, False, False]


def test_a_pause_a_loop_and_a_fast_bag_are_not_astray():
    assert not any(astray([0.0, 0.1, 60.0, 60.1]))
    assert not any(astray([50.0, 50.1, 0.0, 0.1], [0.0, 0.1, 0.2, 0.3]))
    assert not any(astray([0.0, 5.0, 10.0, 15.0], [0.0, 0.01, 0.02, 0.03]))


@pytest.mark.parametrize('lost', [0.0, 0.2, 0.6, 0.8])
def test_the_share_of_images_lost_at_random(lost):
    """A camera of 30 Hz whose stamps jitter by 5 %."""
    rng = np.random.default_rng(1)
    stamps = START + np.cumsum(rng.normal(1, 0.05, 600) * SECOND / 30).astype(int)
    watch = StampMonitor()
    arrived = stamps[rng.random(600) >= lost]
    for stamp in arrived:
        watch.is_astray(int(stamp), 0.0)
    assert watch.missing_share == pytest.approx(lost, abs=0.1)
    assert watch.missing == pytest.approx(600 - len(arrived), abs=60)


def test_of_a_few_images_nothing_is_said():
    watch = StampMonitor()
    for stamp in (0, 1, 5, 6, 10):
        watch.is_astray(START + stamp * SECOND // 30, 0.0)
    assert watch.missing_share == watch.missing == 0


def missing(stamps):
    """Return how many of a stream's images are taken for missing, and their share lately."""
    watch = StampMonitor()
    for stamp in stamps:
        watch.is_astray(int(stamp), 0.0)
    return watch.missing, watch.missing_share


def test_images_that_come_late_are_not_missing():
    """One in fifteen is stamped late by up to two periods, and the next in its wake."""
    rng = np.random.default_rng(2)
    ticks = START + np.arange(900) * SECOND / 30
    late = (rng.random(900) < 1 / 15) * rng.uniform(0.0, 2.0, 900) * SECOND / 30
    stamps = np.maximum.accumulate(ticks + late) + np.arange(900) * 10 ** 5
    count, share = missing(stamps)
    assert count <= 2
    assert share < 0.05
    # what is missing besides is found all the same
    arrived = rng.random(900) >= 0.3
    count, share = missing(stamps[arrived])
    assert count == pytest.approx(900 - arrived.sum(), rel=0.3)
    assert share == pytest.approx(0.3, abs=0.12)


@pytest.mark.parametrize('lost', [0.0, 0.3])
@pytest.mark.parametrize('seed', range(3))
def test_images_stamped_some_periods_late_are_not_missing(seed, lost):
    """One in ten is stamped late by up to four periods, and the next ones in its wake."""
    rng = np.random.default_rng(seed)
    late = (rng.random(900) < 0.1) * rng.uniform(0.0, 4.0, 900)
    stamps = np.maximum.accumulate(np.arange(900) + late) * SECOND / 30 + np.arange(900) * 10 ** 5
    arrived = rng.random(900) >= lost
    count, share = missing(START + stamps[arrived])
    assert count == pytest.approx(900 - arrived.sum(), rel=0.25, abs=4)
    assert share == pytest.approx(lost, abs=0.12 if lost else 0.04)


@pytest.mark.parametrize('lost', [0.0, 0.3])
@pytest.mark.parametrize('seed', range(3))
def test_images_that_come_out_of_order_are_not_missing(seed, lost):
    """One in ten arrives up to four periods late, with the stamp it should have."""
    rng = np.random.default_rng(seed)
    ticks = np.arange(900) + rng.normal(0.0, 0.02, 900)
    arrivals = np.arange(900) + (rng.random(900) < 0.1) * rng.uniform(1.0, 4.0, 900)
    order = np.argsort(arrivals)
    order = order[rng.random(900) >= lost]
    count, share = missing(START + ticks[order] * SECOND / 30)
    assert count == pytest.approx(900 - len(order), rel=0.05, abs=1)
    assert share == pytest.approx(lost, abs=0.12 if lost else 0.02)


def test_an_image_that_comes_twice_does_not_make_up_for_a_missing_one():
    stamps = START + np.delete(np.arange(300), np.s_[5::10]) * SECOND // 30
    count, share = missing(np.repeat(stamps, 2))
    assert count == pytest.approx(30, abs=1)
    assert share == pytest.approx(0.1, abs=0.01)


def test_a_recording_that_loops_goes_on_counting():
    stamps = START + np.delete(np.arange(120), np.s_[5::10]) * SECOND // 30
    count, _ = missing(np.concatenate([stamps, stamps, stamps]))
    assert count == pytest.approx(36, abs=3)


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('jitter', [0.1, 0.2, 0.5])
def test_of_stamps_that_jitter_nothing_is_said(jitter, seed):
    rng = np.random.default_rng(seed)
    ticks = START + np.arange(900) * SECOND / 30
    count, share = missing(np.sort(ticks + rng.normal(0.0, jitter, 900) * SECOND / 30))
    assert count <= 2
    assert share < 0.05
