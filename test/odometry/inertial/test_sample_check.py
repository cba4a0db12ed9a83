# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which samples of a sensor are used, by samples made by hand."""

import numpy as np
import pytest

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER
from aick_ros.odometry.inertial.sample_check import SampleCheck

PERIOD = NANOSECONDS // 100


@pytest.fixture
def check():
    return SampleCheck('gyroscope', 'rad/s', 10.0)


def used(check, stamps, values):
    """Return the stamps of the samples that are used; each value counts for all three axes."""
    values = np.repeat(np.array(values, float)[:, None], 3, axis=1)
    return check.usable(np.array(stamps, np.int64), values)[0].tolist()


def test_values_up_to_the_largest_are_used_and_those_of_no_sensor_counted(check):
    values = [10.0, -10.0, 10.001, -10.001, np.inf, np.nan]
    assert used(check, range(1, 7), values) == [1, 2]
    assert check.dropped == 3  # NaN is what was not measured


def test_one_axis_that_is_missing_or_too_large_is_enough(check):
    values = np.array([[1, 2, 3], [np.nan, 2, 3], [1, 11, 3]])
    assert check.usable(np.arange(3), values)[0].tolist() == [0]
    assert check.dropped == 2


@pytest.mark.parametrize('back, is_restart', [(0, False), (PERIOD, False), (RESTART_AFTER, False),
                                              (RESTART_AFTER + 1, True)])
def test_stamps_that_repeat_or_go_back_are_dropped_and_a_restart_is_followed(
        check, back, is_restart):
    start = 100 * NANOSECONDS
    assert used(check, [start, start - back, start - back + 1], [1, 2, 3]) == (
        [start, start - back, start - back + 1] if is_restart
        else [start] if back else [start, start + 1])
    assert check.dropped == (0 if is_restart else 2 if back else 1)


def test_a_value_is_unchanged_after_more_than_half_a_second(check):
    stamps = np.arange(1, 102) * PERIOD
    assert len(used(check, stamps[:51], [0.5] * 51)) == 51
    assert check.unchanged == ''
    used(check, stamps[51:52], [0.5])
    assert check.unchanged == ('the gyroscope has reported (0.5, 0.5, 0.5) rad/s for 0.5 s')
    used(check, stamps[52:], [0.5] * 49)
    assert check.unchanged.endswith('for 1.0 s')
    used(check, [102 * PERIOD], [0.500001])
    assert check.unchanged == ''


@pytest.mark.parametrize('count, asked, is_so', [
    (51, 1, False), (52, 1, True), (52, 0, False), (52, 30, True)],
    ids=['not for long', 'from then on', 'changed since', 'for longer'])
def test_a_value_is_unchanged_since_a_stamp(check, count, asked, is_so):
    assert not check.is_unchanged_since(0)
    used(check, [0], [1])
    used(check, PERIOD * np.arange(1, count + 1), count * [2])
    assert check.is_unchanged_since(asked * PERIOD) is is_so


def test_a_value_is_unchanged_from_its_first_sample_to_the_last(check):
    assert not check.was_unchanged_at(0)
    used(check, PERIOD * np.arange(4), [1, 2, 2, 2])
    assert [check.was_unchanged_at(PERIOD * at) for at in range(5)] == [
        False, True, True, True, False]


def test_it_was_no_longer_unchanged_than_since_a_restart(check):
    used(check, [100 * NANOSECONDS], [0.5])
    used(check, np.arange(1, 52) * PERIOD, [0.5] * 51)
    assert check.unchanged == ''
    used(check, [52 * PERIOD], [0.5])
    assert check.unchanged


@pytest.mark.parametrize('seed', range(20))
def test_samples_together_are_used_as_one_by_one(seed):
    rng = np.random.default_rng(seed)
    steps = rng.choice([PERIOD, 0, -PERIOD, -2 * RESTART_AFTER, 70 * PERIOD], 60,
                       p=[0.8, 0.06, 0.06, 0.04, 0.04])
    stamps = 100 * NANOSECONDS + np.cumsum(steps)
    values = rng.choice([0.5, 0.5, 0.5, 1.0, 20.0, np.nan], 60)
    checks = [SampleCheck('gyroscope', 'rad/s', 10.0) for _ in range(2)]
    start = 0
    for end in [*np.sort(rng.integers(0, 60, 4)), 60]:
        together = used(checks[0], stamps[start:end], values[start:end])
        assert together == [stamp for i in range(start, end) for stamp in used(
            checks[1], stamps[i:i + 1], values[i:i + 1])]
        assert checks[0].unchanged == checks[1].unchanged
        assert checks[0].dropped == checks[1].dropped
        start = end
