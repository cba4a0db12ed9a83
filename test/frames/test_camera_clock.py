# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The beat of a camera found again in stamps that were shaken."""

import numpy as np
import pytest

from aick_ros.frames.camera_clock import CameraClock
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

SETTLED = 100  # frames


def shaken(rate, jitter, count=600, missing=0.1, seed=0, start=5.0):
    """Return when images were taken [s] and their stamps [ns], late or early by a jitter [s]."""
    rng = np.random.default_rng(seed)
    beats = np.flatnonzero(rng.random(count) >= missing)
    taken = start + beats / rate
    return taken, np.rint((taken + rng.normal(0, jitter, len(taken))) * NANOSECONDS).astype(int)


def corrected(clock, stamps):
    """Return what the clock makes of the stamps [s]."""
    return np.array([stamp / NANOSECONDS + clock.correct(stamp) for stamp in stamps.tolist()])


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize('rate', [15.0, 29.97, 30.0, 90.0])
@pytest.mark.parametrize('share', [0.01, 0.05, 0.1])
def test_jitter_is_taken_out_though_images_are_missing(rate, share):
    jitter = share / rate
    taken, stamps = shaken(rate, jitter)
    error = corrected(CameraClock(), stamps) - taken
    assert rms(error[SETTLED:]) < 0.4 * jitter
    assert np.abs(error[SETTLED:]).max() < 1.5 * jitter


@pytest.mark.parametrize('share', [0.01, 0.06])
def test_it_does_no_harm_while_it_looks_for_the_beat(share):
    """Images are missing from the start, so the first intervals are of one or more periods."""
    errors = []
    for seed in range(8):
        taken, stamps = shaken(30.0, share / 30, count=60, seed=seed)
        errors.append((corrected(CameraClock(), stamps) - taken)[:40])
    assert rms(errors) < 1.1 * share / 30


@pytest.mark.parametrize('missing', [0.0, 0.1, 0.3])
@pytest.mark.parametrize('share', [0.15, 0.2, 0.3, 0.4])
def test_it_does_no_harm_where_stamps_jitter_too_much_for_a_beat(share, missing):
    ratios = []
    for seed in range(4):
        taken, stamps = shaken(30.0, share / 30, missing=missing, seed=seed)
        error = corrected(CameraClock(), stamps) - taken
        ratios.append(rms(error) / rms(stamps / NANOSECONDS - taken))
    assert np.mean(ratios) < 1.03


def test_stamps_far_off_are_put_on_the_beat_and_do_not_move_it():
    """A bus that is busy now and then: some of the stamps are late by two fifths of a period."""
    taken, stamps = shaken(30.0, 0.0005)
    delayed = np.flatnonzero(np.random.default_rng(1).random(len(stamps)) < 0.06)
    stamps[delayed] += round(0.4 / 30 * NANOSECONDS)
    error = corrected(CameraClock(), stamps) - taken
    assert np.count_nonzero(delayed > SETTLED) > 20
    assert np.abs(error[SETTLED:]).max() < 0.001


def test_steady_stamps_are_left_alone():
    taken, stamps = shaken(30.0, 0.0)
    clock = CameraClock()
    np.testing.assert_allclose(corrected(clock, stamps), taken, atol=2e-9)
    assert clock.jitter < 2e-9


@pytest.mark.parametrize('jitter', [0.0005, 0.002])
def test_the_jitter_is_that_of_the_stamps(jitter):
    taken, stamps = shaken(30.0, jitter, count=3000)
    clock, squares = CameraClock(), []
    assert clock.jitter == 0.0
    for stamp in stamps.tolist():
        clock.correct(stamp)
        squares.append(clock.jitter ** 2)
    # it remembers some forty frames, so one reading alone scatters by a tenth
    assert np.sqrt(np.mean(squares[SETTLED:])) == pytest.approx(
        np.std(stamps / NANOSECONDS - taken), rel=0.1)


@pytest.mark.parametrize('rates', [(30.0, 15.0), (15.0, 30.0), (30.0, 25.0), (60.0, 6.0)])
def test_follows_a_change_of_the_rate(rates):
    jitter = 0.001
    before, after = (shaken(rate, jitter, seed=i, start=start)
                     for i, (rate, start) in enumerate(zip(rates, (5.0, 105.0))))
    clock = CameraClock()
    corrected(clock, before[1])
    error = corrected(clock, after[1]) - after[0]
    assert np.abs(error).max() < 0.5 / min(rates)
    assert rms(error[SETTLED:]) < 0.5 * jitter


def test_starts_again_with_a_recording_that_does():
    taken, stamps = shaken(30.0, 0.002)
    clock = CameraClock()
    corrected(clock, stamps)
    again = stamps - 3 * (stamps[-1] - stamps[0])
    assert again[0] < stamps[-1] - RESTART_AFTER
    error = corrected(clock, again) - (taken - 3 * (stamps[-1] - stamps[0]) / NANOSECONDS)
    assert error[0] == pytest.approx((stamps[0] / NANOSECONDS) - taken[0], abs=1e-8)
    assert rms(error[SETTLED:]) < 0.4 * 0.002


@pytest.mark.parametrize('back', [0, 1, NANOSECONDS // 2])
def test_a_stamp_that_repeats_or_goes_back_a_little_tells_nothing(back):
    _, stamps = shaken(30.0, 0.002)
    clock, other = CameraClock(), CameraClock()
    corrected(clock, stamps[:300])
    corrected(other, stamps[:300])
    assert clock.correct(int(stamps[299]) - back) == 0.0
    np.testing.assert_array_equal(corrected(clock, stamps[300:]), corrected(other, stamps[300:]))


@pytest.mark.parametrize('seed', range(3))
def test_where_there_is_no_beat_the_stamps_hold(seed):
    """Images taken when somebody asks for one."""
    rng = np.random.default_rng(seed)
    intervals = rng.uniform(0.02, 0.2, 500)
    stamps = np.rint(np.cumsum(intervals) * NANOSECONDS).astype(int)
    clock = CameraClock()
    corrections = corrected(clock, stamps) - stamps / NANOSECONDS
    np.testing.assert_allclose(corrections, 0.0, atol=1e-9)
