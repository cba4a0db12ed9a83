# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Values of the diagnostics."""

import dataclasses

import numpy as np
import pytest

from aick_ros.ros.health.diagnostics import values_of

KEY = 'delay since the stamp [ms]'


def test_delays_are_medians(frames):
    frames.answer(3)
    values = values_of(frames.snapshot())
    assert (values['delay [ms]'], values[KEY]) == ('10.0', '50.0')


def test_the_longest_delay_is_that_of_99_in_a_hundred(frames):
    frames.answer(3)
    values = values_of(dataclasses.replace(frames.snapshot(), delays=np.arange(101.0)))
    assert (values['delay [ms]'], values['delay, 99 % [ms]']) == ('50.0', '99.0')


@pytest.mark.parametrize('years', [-9, 9])
def test_stamps_of_a_recording_beside_the_clock_of_today_are_no_delay(frames, years):
    frames.answer(3)
    ages = np.full(3, years * 3.15e10)
    values = values_of(dataclasses.replace(frames.snapshot(), ages=ages))
    assert values[KEY].startswith('unknown: the stamps are of another clock')
