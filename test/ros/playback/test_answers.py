# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Delays and rate of answers whose times are given."""

import numpy as np
import pytest

from aick_ros.ros.conversions import UNKNOWN
from aick_ros.ros.playback.answers import Answer, LiveRun


def answer(stamp, received_at, covariance=np.zeros((6, 6))):
    return Answer(stamp, np.eye(4), covariance, np.zeros(6), received_at)


@pytest.fixture
def run():
    """Return a run whose images were published a second apart, answered out of order."""
    return LiveRun({10: 100.0, 20: 101.0, 30: 102.0},
                   [answer(20, 101.25), answer(10, 101.5), answer(30, 102.75)])


def test_delays_are_those_of_the_image_that_is_answered(run):
    np.testing.assert_array_equal(run.delays, [0.25, 1.5, 0.75])


def test_the_rate_counts_the_intervals_between_answers(run):
    assert run.rate == pytest.approx(2 / 1.5)
    run.answers.pop()
    assert run.rate == pytest.approx(1 / 0.25)


@pytest.mark.parametrize('count', [0, 1])
def test_fewer_than_two_answers_have_no_rate(run, count):
    assert LiveRun(run.published_at, run.answers[:count]).rate == 0.0


def test_without_an_answer_there_are_no_delays():
    assert LiveRun({10: 1.0}).delays.shape == (0,)


def test_answers_to_images_of_another_camera_are_dropped(run):
    run.answers[1:1] = [answer(11, 1.0), answer(40, 2.0)]
    played = run.of_played_images()
    assert [each.stamp for each in played.answers] == [20, 10, 30]
    assert played.published_at == run.published_at
    assert len(run.answers) == 5


@pytest.mark.parametrize('variance, tracked', [
    (UNKNOWN[0, 0], False), (np.nextafter(UNKNOWN[0, 0], 0), True), (1e9, False), (0.0, True)])
def test_a_pose_with_the_covariance_of_no_measurement_is_not_tracked(variance, tracked):
    covariance = np.diag([variance, 1e-4, 1e9, 1e9, 1e9, 1e9])
    assert answer(1, 0.0, covariance).tracked is tracked
