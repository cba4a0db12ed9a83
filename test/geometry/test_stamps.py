# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Stamps against the message of ROS."""

import numpy as np
import pytest

from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS, seconds


def test_time_runs_from_the_first_to_the_second():
    assert seconds(3 * NANOSECONDS, 5 * NANOSECONDS) == 2.0
    assert seconds(5 * NANOSECONDS, 3 * NANOSECONDS) == -2.0


def test_stamps_of_today_lose_no_nanosecond():
    """As a float64 a stamp has steps of 256 ns."""
    today = 1_785_000_000 * NANOSECONDS
    assert seconds(today + 1, today + 2) == 1e-9


def test_the_largest_stamp_is_that_of_the_message():
    time = pytest.importorskip('builtin_interfaces.msg').Time
    largest = np.iinfo(time.get_fields_and_field_types()['sec']).max
    assert divmod(MAX_STAMP, NANOSECONDS) == (largest, NANOSECONDS - 1)
