# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Acquisition times recovered from stamps with simulated jitter, delays and missing images."""

import numpy as np
import pytest

from aick_ros.frames.camera_clock import CameraClock, scatter
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

SETTLED = 100  # frames, after which the loop has converged


def simulate(rate, jitter, count=600, missing=0.1, seed=0, start=5.0):
    """Return acquisition times [s] and stamps [ns] with normal jitter [s]."""
    rng = np.random.default_rng(seed)
    frames = np.flatnonzero(rng.random(count) >= missing)
    taken = start + frames / rate
    return taken, np.rint((taken + rng.normal(0, jitter, len(taken))) * NANOSECONDS).astype(int)


def corrected(clock, stamps):
    """Return the corrected stamps [s]."""
    return np.array([stamp / NANOSECONDS + clock.correct(stamp) for stamp in stamps.tolist()])


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize('rate', [15.0, 29.97, 30.0, 90.0])
@pytest.mark.parametrize('share', [0.01, 0.05, 0.1])
def test_jitter_is_removed_with_missing_images(rate, share):
    jitter = share / rate
    taken, stamps = simulate(rate, jitter)
    error = corrected(CameraClock(), stamps) - taken
    assert rms(error[SETTLED:]) < 0.4 * jitter
    assert np.abs(error[SETTLED:]).max() < 1.5 * jitter


def test_most_images_may_be_missing_once_the_loop_is_locked():
    """An error of the period acts once per period, so it is corrected by the number of them."""
    for seed in range(4):
        taken, stamps = simulate(30.0, 0.05 / 30, count=3000, missing=0.0, seed=seed)
        rng = np.random.default_rng(seed)
        kept = (np.arange(len(taken)) < SETTLED) | (rng.random(len(taken)) < 0.1)
        error = corrected(CameraClock(), stamps[kept]) - taken[kept]
        assert rms(error[SETTLED:]) < 0.4 * 0.05 / 30


@pytest.mark.parametrize('share', [0.01, 0.06])
def test_stamps_do_not_get_worse_before_the_lock(share):
    """Images are missing from the start, so the first intervals are of one or more periods."""
    errors = []
    for seed in range(8):
        taken, stamps = simulate(30.0, share / 30, count=60, seed=seed)
        errors.append((corrected(CameraClock(), stamps) - taken)[:40])
    assert rms(errors) < 1.1 * share / 30


@pytest.mark.parametrize('missing', [0.0, 0.1, 0.3])
@pytest.mark.parametrize('share', [0.15, 0.2, 0.3, 0.4])
def test_stamps_do_not_get_worse_if_the_jitter_is_too_large_for_a_lock(share, missing):
    ratios = []
    for seed in range(4):
        taken, stamps = simulate(30.0, share / 30, missing=missing, seed=seed)
        error = corrected(CameraClock(), stamps) - taken
        ratios.append(rms(error) / rms(stamps / NANOSECONDS - taken))
    assert np.mean(ratios) < 1.03


def test_a_late_stamp_before_the_lock_is_no_jitter():
    """Stamps without jitter, the sixth of which is late by two fifths of a period."""
    clock, period = CameraClock(), NANOSECONDS // 30
    for i in range(12):
        clock.correct(NANOSECONDS + i * period + (i == 5) * 2 * period // 5)
    assert clock.jitter == pytest.approx(0.0, abs=1e-9)


def test_outliers_are_corrected_and_do_not_disturb_the_phase():
    """A bus that is busy now and then: some stamps are late by two fifths of a period."""
    taken, stamps = simulate(30.0, 0.0005)
    delayed = np.flatnonzero(np.random.default_rng(1).random(len(stamps)) < 0.06)
    stamps[delayed] += round(0.4 / 30 * NANOSECONDS)
    error = corrected(CameraClock(), stamps) - taken
    assert np.count_nonzero(delayed > SETTLED) > 20
    assert np.abs(error[SETTLED:]).max() < 0.001


def test_exact_stamps_are_not_changed():
    taken, stamps = simulate(30.0, 0.0)
    clock = CameraClock()
    np.testing.assert_allclose(corrected(clock, stamps), taken, atol=2e-9)
    assert clock.jitter < 2e-9


@pytest.mark.parametrize('jitter', [0.0005, 0.002])
def test_the_jitter_is_the_standard_deviation_of_the_stamps(jitter):
    taken, stamps = simulate(30.0, jitter, count=3000)
    clock, squares = CameraClock(), []
    for stamp in stamps[:2].tolist():
        clock.correct(stamp)
    for stamp in stamps[2:].tolist():
        clock.correct(stamp)
        squares.append(clock.jitter ** 2)
    # the mean of a window of some forty frames scatters by a tenth
    assert np.sqrt(np.mean(squares[SETTLED:])) == pytest.approx(
        np.std(stamps / NANOSECONDS - taken), rel=0.1)


def test_the_loop_begins_with_the_line_through_its_stamps():
    """The first corrections are the residuals of ordinary least squares over all stamps."""
    _, stamps = simulate(30.0, 0.001, count=18, missing=0.0)
    clock, seconds = CameraClock(), (stamps - stamps[0]) / NANOSECONDS
    corrections = np.array([clock.correct(stamp) for stamp in stamps.tolist()])
    first = np.flatnonzero(corrections)[0]
    assert first == 14  # the fifteenth stamp
    for i in range(first, len(stamps)):
        line = np.polyfit(np.arange(i + 1), seconds[:i + 1], 1)
        assert corrections[i] == pytest.approx(np.polyval(line, i) - seconds[i], abs=1e-9)


def test_irregular_stamps_do_not_count_against_the_camera_that_follows():
    """Images on a trigger, then at a rate: one late stamp is an outlier, the lock stays."""
    intervals = np.random.default_rng(3).uniform(0.02, 0.2, 500)
    clock = CameraClock()
    corrected(clock, np.rint(np.cumsum(intervals) * NANOSECONDS).astype(int))
    taken, stamps = simulate(30.0, 0.0, missing=0.0, start=200.0)
    stamps[SETTLED] += round(0.4 / 30 * NANOSECONDS)
    error = corrected(clock, stamps) - taken
    assert np.abs(error[SETTLED:]).max() < 1e-4


@pytest.mark.parametrize('rates', [(30.0, 15.0), (15.0, 30.0), (30.0, 25.0), (60.0, 6.0)])
def test_a_change_of_the_rate_is_followed(rates):
    jitter = 0.001
    before, after = (simulate(rate, jitter, seed=i, start=start)
                     for i, (rate, start) in enumerate(zip(rates, (5.0, 105.0))))
    clock = CameraClock()
    corrected(clock, before[1])
    error = corrected(clock, after[1]) - after[0]
    assert np.abs(error).max() < 0.5 / min(rates)
    assert rms(error[SETTLED:]) < 0.5 * jitter


def test_a_new_recording_restarts_the_loop():
    taken, stamps = simulate(30.0, 0.002)
    clock = CameraClock()
    corrected(clock, stamps)
    restarted = stamps - 3 * (stamps[-1] - stamps[0])
    assert restarted[0] < stamps[-1] - RESTART_AFTER
    error = corrected(clock, restarted) - (taken - 3 * (stamps[-1] - stamps[0]) / NANOSECONDS)
    assert error[0] == pytest.approx((stamps[0] / NANOSECONDS) - taken[0], abs=1e-8)
    assert rms(error[SETTLED:]) < 0.4 * 0.002


@pytest.mark.parametrize('rates', [(30.0, 30.0), (30.0, 15.0), (15.0, 60.0)])
def test_a_restart_leaves_nothing_of_phase_and_period(rates):
    """Another recording may be of another rate."""
    before, after = (simulate(rate, 0.001, seed=i, start=start)[1]
                     for i, (rate, start) in enumerate(zip(rates, (105.0, 5.0))))
    clock = CameraClock()
    corrected(clock, before)
    np.testing.assert_array_equal(corrected(clock, after), corrected(CameraClock(), after))


@pytest.mark.parametrize('back', [0, 1, NANOSECONDS // 2, RESTART_AFTER])
def test_a_repeated_or_late_stamp_changes_nothing(back):
    _, stamps = simulate(30.0, 0.002)
    clock, other = CameraClock(), CameraClock()
    corrected(clock, stamps[:300])
    corrected(other, stamps[:300])
    assert clock.correct(int(stamps[299]) - back) == 0.0
    np.testing.assert_array_equal(corrected(clock, stamps[300:]), corrected(other, stamps[300:]))


@pytest.mark.parametrize('seed', range(3))
def test_without_a_constant_rate_stamps_are_not_changed(seed):
    """Images taken on a trigger."""
    rng = np.random.default_rng(seed)
    intervals = rng.uniform(0.02, 0.2, 500)
    stamps = np.rint(np.cumsum(intervals) * NANOSECONDS).astype(int)
    clock = CameraClock()
    corrections = corrected(clock, stamps) - stamps / NANOSECONDS
    np.testing.assert_allclose(corrections, 0.0, atol=1e-9)


def test_more_than_a_second_back_is_another_recording():
    stamps = [(300 + i) * NANOSECONDS // 30 for i in range(40)]
    clock = CameraClock()
    corrected(clock, np.array(stamps))
    assert clock.is_behind(stamps[-1] - RESTART_AFTER)
    assert not clock.is_behind(stamps[-1] - RESTART_AFTER - 1)
    assert not clock.is_behind(stamps[-1] + 1)
    assert not CameraClock().is_behind(5)


@pytest.mark.parametrize('share', [0.03, 0.06])
def test_a_quarter_of_the_jitter_remains(share):
    """
    The variance that an alpha-beta filter leaves of white noise (Kalata 1984), in closed form.

    For the gains a and b = a^2 / 4 of critical damping, after the correction by the stamp itself.
    """
    a = 0.1
    b = a ** 2 / 4
    expected = np.sqrt((2 * a ** 2 + b * (2 - 3 * a)) / (a * (4 - 2 * a - b)))
    assert expected == pytest.approx(0.25, abs=0.01)
    remaining = []
    for seed in range(6):
        taken, stamps = simulate(30.0, share / 30, count=4000, missing=0.0, seed=seed)
        remaining.append(rms((corrected(CameraClock(), stamps) - taken)[300:]) / (share / 30))
    assert rms(remaining) == pytest.approx(expected, rel=0.05)


def settled():
    """Return a clock locked to exact stamps of 32 Hz, and the next stamp [ns]."""
    clock, period = CameraClock(), NANOSECONDS // 32
    for i in range(400):
        clock.correct(10 * NANOSECONDS + i * period)
    return clock, 10 * NANOSECONDS + 400 * period, period


@pytest.mark.parametrize('share, is_outlier', [(0.24, False), (0.26, True)])
@pytest.mark.parametrize('sign', [1, -1])
def test_an_error_of_more_than_a_quarter_period_is_an_outlier(share, is_outlier, sign):
    """The phase follows others by a tenth of their error, and outliers not at all."""
    clock, stamp, period = settled()
    error = sign * round(share * period)
    followed = error + clock.correct(stamp + error) * NANOSECONDS
    assert followed == pytest.approx(0.0 if is_outlier else 0.1 * error, rel=0.01, abs=5.0)


@pytest.mark.parametrize('errors, is_locked', [
    ('xx', True), ('xxx', False), ('xx.x', True), ('xx.xx', False), ('xx..xx', False),
    ('xx...xx', True), ('xx....xxx', False)])
def test_three_outliers_end_the_lock_and_two_inliers_make_up_for_one(errors, is_locked):
    """Written as they come: an outlier by two fifths of a period (x), or none (.)."""
    clock, stamp, period = settled()
    for i, kind in enumerate(errors):
        clock.correct(stamp + i * period + (kind == 'x') * 2 * period // 5)
    late = clock.correct(stamp + len(errors) * period + period // 8)
    assert (late != 0.0) is is_locked


def test_the_jitter_is_of_the_last_twenty_stamps_or_so():
    """An exponential window: after one error the variance decays by a twentieth per stamp."""
    clock, stamp, period = settled()
    clock.correct(stamp + period // 5)
    first = clock.jitter ** 2
    for i in range(1, 4):
        error_of_phase = clock.correct(stamp + i * period) * NANOSECONDS
        assert abs(error_of_phase) < 0.03 * period
    assert clock.jitter ** 2 == pytest.approx(first * 0.95 ** 3, rel=0.05)
    assert first == pytest.approx(0.05 * 0.2 ** 2 / 32 ** 2, rel=0.01)


def test_the_jitter_is_the_mean_square_of_the_first_errors():
    """It is unknown before the third stamp: the second is on the line by definition."""
    clock, period, jitters = CameraClock(), NANOSECONDS // 32, []
    for stamp in (0, period, 2 * period + 1_000_000):
        clock.correct(NANOSECONDS + stamp)
        jitters.append(clock.jitter)
    assert jitters == [None, None, pytest.approx(1e-3, abs=1e-12)]
    # of the line through three stamps, the last of which is e late, the fourth is 4/3 e early
    clock.correct(NANOSECONDS + 3 * period)
    assert clock.jitter ** 2 == pytest.approx((1e-6 + (4 / 3 * 1e-3) ** 2) / 2, rel=1e-6)


def jitters_at_the_start(share, missing, count=200):
    """Return the jitter after 4 to 15 stamps of a camera with one, as its share, runs x 12."""
    found = []
    for seed in range(count):
        clock, jitters = CameraClock(), []
        for stamp in simulate(60.0, share / 60, 40, missing, seed)[1].tolist()[:15]:
            clock.correct(stamp)
            jitters.append(clock.jitter)
        found.append(jitters[3:])
    return np.array(found) * 60 / share


@pytest.mark.parametrize('missing', [0.0, 0.1, 0.3])
@pytest.mark.parametrize('share', [0.02, 0.1, 0.14])
def test_the_jitter_is_seen_before_the_lock(share, missing):
    """Also where much of it restarts the loop again and again."""
    jitters = jitters_at_the_start(share, missing)
    assert 0.8 < np.median(jitters) < 2.1
    assert np.mean(jitters[:, :4] < 0.3) < 0.2
    assert np.mean(jitters[:, 8:] < 0.3) < 0.05


@pytest.mark.parametrize('missing, share', [(0.1, 0.01), (0.3, 0.02), (0.6, 0.05), (0.7, 0.1)])
def test_missing_images_are_hardly_ever_taken_for_jitter(missing, share):
    jitters = []
    for seed in range(100):
        clock = CameraClock()
        for stamp in simulate(60.0, 0.0, 60, missing, seed)[1].tolist():
            clock.correct(stamp)
            jitters.append(clock.jitter)
        assert missing > 0.5 or clock.jitter < 1e-6
    assert np.mean(np.array(jitters, float) > 1e-6) < share


@pytest.mark.parametrize('kept', [(2,), (2, 3), (3, 2, 2), (1, 3)])
def test_stamps_are_exact_where_a_busy_computer_takes_some_images_in_turn(kept):
    frames = np.cumsum(np.resize(kept, 40))
    clock = CameraClock()
    for number, frame in enumerate(frames.tolist()):
        clock.correct(NANOSECONDS * (300 + frame) // 30)
        assert number < 3 or clock.jitter < 1e-6


def test_a_recording_that_starts_again_has_no_jitter_of_the_one_before():
    """Nor of the jump between them, also at another rate."""
    clock = CameraClock()
    for frame in range(10):
        clock.correct((300 + frame) * NANOSECONDS // 30)
    for frame in range(10):
        clock.correct(frame * NANOSECONDS // 25)
        assert clock.jitter is None if frame < 2 else clock.jitter < 1e-6


def test_the_scatter_of_stamps_is_that_of_their_intervals_about_a_rate():
    assert scatter([0, 100]) == 0.0
    assert scatter([0, 100, 200, 306, 400, 500]) == pytest.approx(0.0, abs=1e-8)
    found = [scatter(simulate(10.0, 0.002, 15, 0.0, seed)[1].tolist()) for seed in range(200)]
    assert np.mean(found) == pytest.approx(0.002, rel=0.1)


def test_stamps_without_a_rate_scatter_by_no_more_than_those_of_a_driver():
    intervals = np.random.default_rng(3).uniform(0.02, 0.2, 15)
    assert scatter(np.rint(np.cumsum(intervals) * NANOSECONDS).astype(int).tolist()) == 0.005
