# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Times of the stages by a simulated clock."""

import pytest

from aick_ros.registration import stage_times
from aick_ros.registration.stage_times import STAGES, StageTimes


@pytest.fixture
def wait(monkeypatch):
    """Return a function that lets seconds pass."""
    now = [100.0]
    monkeypatch.setattr(stage_times, 'clock', lambda: now[0])

    def pass_by(seconds):
        now[0] += seconds
    return pass_by


def test_stages_are_summed_up_and_what_lies_between_them_is_not(wait):
    times = StageTimes()
    for seconds in (0.001, 0.002):
        with times.stage('registration'):
            wait(seconds)
        wait(1.0)
    with times.stage('features'):
        wait(0.004)
    assert times.take() == pytest.approx({
        'features': 4.0, 'surface': 0.0, 'registration': 3.0, 'refinement': 0.0, 'total': 7.0})


def test_take_resets_the_times(wait):
    times = StageTimes()
    with times.stage('features'):
        wait(0.004)
    times.take()
    assert times.take() == dict.fromkeys([*STAGES, 'total'], 0.0)


def test_added_times_are_counted_once(wait):
    """As those of the frames that another thread has prepared, added frame by frame."""
    times, others = StageTimes(), StageTimes()
    for seconds in (0.001, 0.002, 0.004):
        with others.stage('features'):
            wait(seconds)
        times.add(others)
    assert others.take()['total'] == 0.0
    assert times.take()['features'] == pytest.approx(7.0)


def test_the_time_of_a_failed_stage_counts(wait):
    times = StageTimes()
    with pytest.raises(ZeroDivisionError), times.stage('surface'):
        wait(0.5)
        1 / 0
    assert times.take()['surface'] == pytest.approx(500.0)
