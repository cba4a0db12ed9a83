# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Values of the diagnostics."""

import dataclasses

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.parameter import Parameter
from rclpy.time import Time
from std_msgs.msg import Header

from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics, values_of

KEY = 'delay since the stamp [ms]'


@pytest.fixture
def published(graph):
    """Return a function that publishes and returns the message; what is counted, and the node."""
    node = graph.node(namespace='robot', parameter_overrides=[
        Parameter('use_sim_time', value=True)])
    node.get_clock().set_ros_time_override(Time(seconds=5, nanoseconds=7))
    diagnostics = Diagnostics(node)
    received = graph.listen(DiagnosticArray, '/diagnostics')

    def publish(complaint='', paused=False, present={}, concern=''):
        diagnostics.publish(complaint, paused, present, concern)
        graph.wait_until(lambda: received, 'the diagnostics')
        return received.pop()
    publish.diagnostics, publish.node = diagnostics, node
    return publish


def test_it_is_published_where_monitors_look_with_the_name_of_the_node_and_the_time(published):
    [publisher] = [each for each in published.node.publishers if each.msg_type is DiagnosticArray]
    assert (publisher.topic_name, publisher.qos_profile.depth) == ('/diagnostics', 10)
    message = published()
    assert message.header == Header(stamp=Time(seconds=5, nanoseconds=7).to_msg())
    [status] = message.status
    assert (status.name, status.hardware_id) == ('robot/odom_node: odometry', '')
    assert status.level == DiagnosticStatus.WARN
    assert status.message == f'{Status.NO_FRAME.value}: waiting for images'


@pytest.mark.parametrize('given, level, sentence', [
    ({'paused': True, 'complaint': 'no depth'}, DiagnosticStatus.WARN, 'paused: call ~/resume'),
    ({'complaint': 'no depth', 'concern': 'load'}, DiagnosticStatus.WARN, 'no depth'),
    ({'concern': 'load'}, DiagnosticStatus.WARN, 'load')])
def test_level_and_sentence_are_those_of_what_is_given(published, given, level, sentence):
    [status] = published(**given).status
    assert (status.level, status.message[:len(sentence)]) == (level, sentence)


def test_a_defect_is_an_error(published):
    published.diagnostics.damaged('why', Count.FAILED)
    [status] = published().status
    assert status.level == DiagnosticStatus.ERROR
    values = {value.key: value.value for value in status.values}
    assert (values['internal errors'], values['status']) == (
        '1', f'{Status.BAD_FRAME.value}: why')


def test_present_values_are_added_and_take_precedence(published):
    published.diagnostics.count(Count.RECEIVED, 3)
    [status] = published(present={'backlog': '2', 'frames received': '4'}).status
    values = [(value.key, value.value) for value in status.values]
    assert ('backlog', '2') in values and ('frames received', '4') in values
    assert len(dict(values)) == len(values)


def test_rates_shares_and_times_are_numbers_with_their_unit_in_the_key(frames):
    """300 frames at 30 Hz, of which the last 30 were lost."""
    frames.answer(270, matches=101)
    frames.answer(30, Status.TOO_FEW_MATCHES, matches=3, total=40.0)
    frames.count(Count.RECEIVED, 15)
    values = values_of(frames.snapshot())
    assert {key: values[key] for key in (
        'status', 'input rate [Hz]', 'output rate [Hz]', 'lost share', 'inliers', 'total [ms]',
        'frames received', 'frames answered', 'frames lost')} == {
            'status': f'{Status.TOO_FEW_MATCHES.value}: 3 matches', 'input rate [Hz]': '31.5',
            'output rate [Hz]': '30.0', 'lost share': '0.100', 'inliers': '101',
            'total [ms]': '20.00', 'frames received': '315', 'frames answered': '300',
            'frames lost': '30'}


def test_before_the_first_answer_there_is_no_delay(frames):
    frames.receive()
    assert not any('delay' in key for key in values_of(frames.snapshot()))


@pytest.mark.parametrize('age, text', [(3.6e6, '3600000.0'), (-3.6e6, '-3600000.0')])
def test_an_hour_is_still_a_delay(frames, age, text):
    frames.answer(3)
    assert values_of(dataclasses.replace(
        frames.snapshot(), ages=np.full(3, age)))[KEY] == text


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
