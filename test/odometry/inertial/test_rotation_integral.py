# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The integral of turn rates against rotations that are known in closed form."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.rotation_integral import RotationIntegral

NO_BIAS = np.zeros(3)
MS = NANOSECONDS // 1000


def rotation(time):
    """Return a rotation about axes that move: no two turns commute."""
    return (se3.exp_rotation((0, 0, 0.7 * np.sin(3 * time)))
            @ se3.exp_rotation((0.5 * np.cos(2 * time), 0.4 * time, 0)))


def rate(time, step=1e-5):
    """Return the turn rate by a central difference."""
    return se3.log_rotation(rotation(time - step).T @ rotation(time + step)) / (2 * step)


def integral(rates, period=2 * MS, bias=NO_BIAS):
    result = RotationIntegral()
    rates = np.asarray(rates) + bias
    stamps = period * np.arange(len(rates))
    for count in np.split(np.arange(len(rates)), [1, 4, 5]):  # as with each image
        result.add(stamps[count], rates[count])
    return result


def add(result, stamp, value):
    result.add(np.array([stamp]), np.array([value], float))


@pytest.fixture(scope='module')
def moving():
    return integral([rate(0.002 * i) for i in range(1001)])


@pytest.mark.parametrize('frequency', [1.0, 2.0, 3.0])
@pytest.mark.parametrize('period', [5, 20, 40])
def test_far_samples_leave_the_error_that_is_said_of_them(period, frequency):
    """Of turns between any two times by a rate that swings; three times as large at most."""
    result, swing = RotationIntegral(), 2.0 * np.pi * frequency
    stamps = period * MS * np.arange(3000 // period)
    rates = np.outer(np.sin(swing * 1e-9 * stamps), [0.0, 1.5, 0.0])
    for at in range(0, len(stamps), 4):
        result.add(stamps[at:at + 4], rates[at:at + 4])
    rng, errors = np.random.default_rng(1), []
    for start, end in np.sort(rng.integers(1000, 2900, (500, 2))):
        turn = result.between(start * MS, end * MS, NO_BIAS)
        true = 1.5 / swing * (np.cos(swing * start / 1000) - np.cos(swing * end / 1000))
        errors.append(se3.log_rotation(turn.rotation)[1] - true)
    about_one_of_three = np.mean(np.square(errors)) / 3
    assert 1 / 9 < about_one_of_three / result.interpolation_variance < 2.0


def test_of_no_samples_nothing_is_between():
    assert RotationIntegral().interpolation_variance == 0.0
    assert integral([np.ones(3)] * 20).interpolation_variance == 0.0


@pytest.mark.parametrize('start, end', [(0, 2000), (501, 1501), (700, 703), (900, 900)])
def test_a_motion_about_moving_axes_is_integrated(moving, start, end):
    turn = moving.between(start * MS, end * MS, NO_BIAS)
    true = rotation(start / 1000).T @ rotation(end / 1000)
    assert se3.angle(true.T @ turn.rotation) < 1e-5
    assert turn.duration == pytest.approx((end - start) / 1000)
    assert np.allclose(turn.rates, [rate(start / 1000), rate(end / 1000)], atol=1e-4)


def test_a_constant_rate_is_exact():
    w = np.array([0.3, -2.0, 1.0])
    turn = integral(200 * [w]).between(33 * MS, 390 * MS, NO_BIAS)
    assert np.allclose(turn.rotation, se3.exp_rotation(0.357 * w), atol=1e-12)


@pytest.mark.parametrize('size', [1e-3, 0.05])
def test_the_derivative_by_the_bias_is_that_of_finite_differences(moving, size):
    """Below the size at which the samples are integrated again, and above it."""
    start, end = 240 * MS, 1233 * MS
    turn = moving.between(start, end, NO_BIAS)
    for axis in np.eye(3):
        again = integral([rate(0.002 * i) - size * axis for i in range(1001)])
        true = again.between(start, end, NO_BIAS).rotation
        assert se3.angle(true.T @ moving.between(start, end, size * axis).rotation) < (
            0.6 * size ** 2 if size < 0.002 else 1e-9)
        change = se3.log_rotation(true @ turn.rotation.T)
        assert np.allclose(change, -turn.by_bias @ axis * size, atol=0.6 * size ** 2)


@pytest.mark.parametrize('size', [1e-3, 0.02])
def test_the_derivative_by_the_matrix_is_that_of_finite_differences(moving, size):
    """Below the size at which the samples are integrated again, and above it."""
    start, end = 240 * MS, 1233 * MS
    turn = moving.between(start, end, NO_BIAS)
    for row, column in np.ndindex(3, 3):
        change = np.zeros((3, 3))
        change[row, column] = size
        matrix = np.eye(3) + change
        again = integral([matrix @ rate(0.002 * i) for i in range(1001)])
        true = again.between(start, end, NO_BIAS).rotation
        assert se3.angle(true.T @ moving.between(start, end, NO_BIAS, matrix).rotation) < (
            3 * size ** 2 if size < 0.002 else 1e-9)
        seen = se3.log_rotation(true @ turn.rotation.T)
        assert np.allclose(seen, turn.by_matrix @ change.ravel(), atol=3 * size ** 2)


def again_by(matrix, bias):
    """Return the integral of rates that are corrected before."""
    return integral([matrix @ (rate(0.002 * i) - bias) for i in range(1001)])


def test_derivatives_are_by_the_bias_of_what_is_measured_and_by_the_matrix(moving):
    bias, matrix = np.array([0.03, -0.02, 0.01]), np.eye(3) + 0.03 * np.arange(9).reshape(3, 3)
    again = again_by(matrix, bias)
    start, end = 240 * MS, 1233 * MS
    turn = moving.between(start, end, bias, matrix)
    expected = again.between(start, end, NO_BIAS)
    assert se3.angle(expected.rotation.T @ turn.rotation) < 1e-9
    assert np.allclose(turn.rates, expected.rates)
    step = 1e-4 * np.array([1.0, -2.0, 3.0])
    moved = moving.between(start, end, bias + step, matrix).rotation
    assert np.allclose(se3.log_rotation(moved @ turn.rotation.T), -turn.by_bias @ step, atol=1e-7)
    change = 1e-4 * np.array([[1.0, -2.0, 3.0], [2.0, 1.0, -1.0], [0.5, -3.0, 1.0]])
    later = again_by(matrix + change, bias).between(start, end, NO_BIAS).rotation
    assert np.allclose(se3.log_rotation(later @ turn.rotation.T), turn.by_matrix @ change.ravel(),
                       atol=3e-7)


def test_the_derivative_by_the_offset_is_that_of_finite_differences(moving):
    turn, step = moving.between(300 * MS, 1300 * MS, NO_BIAS), MS
    later = moving.between(300 * MS + step, 1300 * MS + step, NO_BIAS)
    change = se3.log_rotation(later.rotation @ turn.rotation.T)
    assert np.allclose(change, 0.001 * turn.by_offset, atol=5e-6)


def test_what_was_not_measured_is_not_known(moving):
    assert moving.between(-1, 10 * MS, NO_BIAS) is None
    assert moving.between(0, 2021 * MS, NO_BIAS) is None
    late = moving.between(1990 * MS, 2015 * MS, NO_BIAS)
    assert late.extrapolated == pytest.approx(0.015)
    assert se3.angle(late.rotation.T @ rotation(1.990).T @ rotation(2.015)) < 2e-3
    assert RotationIntegral().between(0, 0, NO_BIAS) is None


@pytest.mark.parametrize('stamp', [251 * MS, 100 * MS])
def test_a_gap_or_an_earlier_stamp_begins_anew(stamp):
    result = integral(101 * [np.ones(3)])
    add(result, stamp, np.zeros(3))
    assert result.between(0, 200 * MS, NO_BIAS) is None
    add(result, stamp + 10 * MS, np.zeros(3))
    assert np.array_equal(result.between(stamp, stamp + 10 * MS, NO_BIAS).rotation, np.eye(3))


def test_old_samples_are_forgotten_and_the_rest_stays():
    axis, seconds = np.array([0.0, 0.1, 0.0]), 0.05 * np.arange(1300)
    result = integral(np.sin(seconds / 5)[:, None] * axis, period=50 * MS)
    assert result.between(0, 64_000 * MS, NO_BIAS) is None
    turn = result.between(35_000 * MS, 64_000 * MS, NO_BIAS)
    angle = 5 * (np.cos(35 / 5) - np.cos(64 / 5))
    assert np.allclose(turn.rotation, se3.exp_rotation(angle * axis), atol=1e-4)
    assert np.allclose(turn.rates[0], np.sin(35 / 5) * axis)


def test_rates_at_the_ends_are_without_the_bias(moving):
    for bias in (np.array([1e-3, -1e-3, 5e-4]), np.array([0.3, -0.2, 0.1])):
        turn = moving.between(501 * MS, 1501 * MS, bias)
        assert np.allclose(turn.rates, [rate(0.501) - bias, rate(1.501) - bias], atol=1e-4)


def test_the_bias_that_was_used_is_not_that_which_the_caller_changes_later(moving):
    bias = np.array([0.3, -0.2, 0.1])
    expected = moving.between(240 * MS, 1233 * MS, bias.copy()).rotation
    moving.between(240 * MS, 1233 * MS, NO_BIAS)
    moving.between(240 * MS, 1233 * MS, bias)
    bias[:] = 0.0
    assert se3.angle(moving.between(240 * MS, 1233 * MS, bias).rotation.T @ expected) > 0.05


@pytest.mark.parametrize('late, is_known', [(20, True), (20.000001, False)])
def test_the_last_rate_holds_for_20_ms(late, is_known):
    w = np.array([0.3, -2.0, 1.0])
    turn = integral(50 * [w]).between(0, 98 * MS + round(late * MS), NO_BIAS)
    assert (turn is not None) == is_known
    if is_known:
        assert np.allclose(turn.rotation, se3.exp_rotation(0.118 * w))
        assert np.allclose(turn.rates, [w, w])
        assert turn.extrapolated == pytest.approx(0.02)


def test_within_the_samples_nothing_is_extrapolated(moving):
    assert moving.last == 2000 * MS and RotationIntegral().last is None
    for end in (1000, 1999, 2000):
        assert moving.between(0, end * MS, NO_BIAS).extrapolated == 0.0


@pytest.mark.parametrize('gap, begins_anew', [(50 * MS, False), (50 * MS + 1, True), (0, True)])
def test_a_gap_is_longer_than_50_ms(gap, begins_anew):
    result = integral(101 * [np.ones(3)])
    add(result, 200 * MS + gap, np.ones(3))
    assert (result.between(0, 200 * MS, NO_BIAS) is None) == begins_anew


@pytest.mark.parametrize('break_at', [60 * MS, 0, -10 * MS])
def test_samples_after_a_gap_among_them_begin_anew(break_at):
    later = np.repeat(np.arange(2), [4, 7]) * (break_at - 2 * MS)
    stamps = 2 * MS * np.arange(11) + later
    w = np.array([0.3, -2.0, 1.0])
    result = integral(3 * [w])
    result.add(stamps + 6 * MS, np.outer(np.arange(11) > 3, w))
    start, end = (int(stamp) + 6 * MS for stamp in stamps[[4, 10]])
    assert result.between(start - 1, end, NO_BIAS) is None
    assert np.allclose(result.between(start, end, NO_BIAS).rotation, se3.exp_rotation(0.012 * w))
    result.add(np.empty(0, np.int64), np.empty((0, 3)))
    assert result.last == end
