# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How long answers are awaited, by answers that come one by one."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry

from aick_ros.geometry import se3
from aick_ros.ros.conversions import odometry, pose_with_covariance
from aick_ros.ros.playback import listener
from aick_ros.ros.playback.listener import Listener


@pytest.fixture
def heard(graph):
    """Return a listener whose callbacks the test calls."""
    return graph.add(Listener())


@pytest.fixture
def answer(heard, monkeypatch):
    """Return a function that answers stamps one by one, and returns those that were awaited."""
    def run(coming, stamps):
        rest = iter(coming)

        def wait_until(condition, timeout):
            for stamp in itertools.islice(rest, 1):
                heard._take(odometry(pose_with_covariance(stamp, 'odom', np.eye(4), np.eye(6)),
                                     'base', np.zeros(6), np.eye(6)))
            return condition()

        monkeypatch.setattr(listener, 'wait_until', wait_until)
        heard.wait_for_answers(stamps)
        return [answer.stamp for answer in heard.answers]
    return run


@pytest.mark.parametrize('coming, awaited', [
    ([10, 20, 30, 40], [10, 20, 30]), ([30, 40], [30]), ([10, 30, 40], [10, 30]),
    ([10, 20], [10, 20]), ([20, 10, 15, 40], [20, 10, 15]), ([], [])])
def test_until_all_are_answered_or_the_last_is_or_no_more_come(answer, coming, awaited):
    assert answer(coming, [10, 20, 30]) == awaited


@pytest.mark.parametrize('coming, damaged, failed, awaited', [
    ([10, 20, 30, 40], 1, 0, [10, 20]), ([10, 20, 30], 1, 1, [10]), ([10], 3, 0, []),
    ([10, 30, 40], 0, 0, [10, 30])])
def test_what_the_node_counts_as_unusable_is_not_awaited(
        heard, answer, coming, damaged, failed, awaited):
    """Otherwise the node says after five seconds that no images come."""
    values = [KeyValue(key='frames damaged', value=str(damaged)),
              KeyValue(key='internal errors', value=str(failed)),
              KeyValue(key='status', value='bad frame: x')]
    for _ in range(2):  # counts are of the whole run
        heard._hear(DiagnosticArray(status=[
            DiagnosticStatus(name='odom_node: odometry', values=values),
            DiagnosticStatus(name='camera: driver', values=[
                KeyValue(key='frames damaged', value='7')])]))
    assert answer(coming, [10, 20, 30]) == awaited


def test_the_wait_ends_as_the_node_says_that_the_rest_is_unusable(heard, monkeypatch):
    ended = []

    def wait_until(condition, timeout):
        ended.append(condition())
        heard._hear(DiagnosticArray(status=[DiagnosticStatus(
            name='odom_node: odometry', values=[KeyValue(key='frames damaged', value='2')])]))
        ended.append(condition())

    monkeypatch.setattr(listener, 'wait_until', wait_until)
    heard.wait_for_answers([10, 20])
    assert ended == [False, True]


def test_no_image_has_no_answer(answer):
    assert answer([10], []) == []


def test_an_answer_has_the_numbers_of_its_message_and_the_time_it_came(heard, monkeypatch):
    monkeypatch.setattr(listener, 'time', SimpleNamespace(monotonic=lambda: 7.5))
    pose, covariance = se3.exp([1, -2, 0.5, 0.3, -0.2, 1.1]), np.diag([2, 3, 4, 5, 6, 7.0])
    covariance[0, 1] = 0.5
    heard._take(odometry(pose_with_covariance(5_000_000_007, 'odom', pose, covariance), 'base',
                         np.arange(1, 7), np.eye(6)))
    [answer] = heard.answers
    assert (answer.stamp, answer.received_at) == (5_000_000_007, 7.5)
    np.testing.assert_allclose(answer.T_odom_base, pose, atol=1e-12)
    np.testing.assert_array_equal(answer.covariance, covariance)
    np.testing.assert_array_equal(answer.twist, np.arange(1, 7))


def test_the_node_is_there_once_its_own_diagnostics_come(heard):
    for names, is_heard in (((), False), (('camera: driver', 'odom_node: images'), False),
                            (('camera: driver', 'odom_node: odometry'), True), ((), True)):
        heard._hear(DiagnosticArray(status=[DiagnosticStatus(name=name) for name in names]))
        assert heard.heard is is_heard


def test_it_listens_to_odometry_and_diagnostics_of_a_long_recording(heard):
    found = {each.topic_name: (each.msg_type, each.qos_profile.depth)
             for each in heard.subscriptions}
    assert found['/odom'] == (Odometry, 1000)
    assert found['/diagnostics'][0] is DiagnosticArray


def test_a_condition_is_waited_for_until_the_time_is_over(monkeypatch):
    clock = SimpleNamespace(now=0.0, monotonic=lambda: clock.now)

    def sleep(seconds):
        clock.now += seconds
    clock.sleep = sleep
    monkeypatch.setattr(listener, 'time', clock)
    assert listener.wait_until(lambda: clock.now >= 1.0, 2.0) is True
    assert clock.now == pytest.approx(1.0, abs=0.01)
    assert listener.wait_until(lambda: False, 2.0) is False
    assert clock.now == pytest.approx(3.0, abs=0.02)
