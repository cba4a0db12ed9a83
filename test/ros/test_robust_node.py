# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages with which rclpy would end a node are rejected with a sentence."""

import pytest
from builtin_interfaces.msg import Time
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter as RosParameter
from rosgraph_msgs.msg import Clock

from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.ros.robust_node import RobustNode


@pytest.fixture
def node(graph):
    made = graph.add(RobustNode('probe', parameter_overrides=[
        RosParameter('use_sim_time', value=True)]))
    made.declare_parameter('number', 1)
    return made


@pytest.mark.parametrize('time', [
    Time(sec=-1), Time(sec=-2 ** 31, nanosec=2 ** 32 - 1),
    Time(sec=2 ** 31 - 1, nanosec=2 ** 32 - 1)], ids=str)
def test_an_impossible_time_is_ignored_and_the_next_one_is_taken(graph, node, time):
    [clock] = [each for each in node.subscriptions if each.topic_name == '/clock']
    clock.callback(Clock(clock=Time(sec=5)))
    for _ in range(20):
        clock.callback(Clock(clock=time))
    assert node.get_clock().now().nanoseconds == 5 * 10 ** 9
    clock.callback(Clock(clock=Time(sec=7)))
    assert node.get_clock().now().nanoseconds == 7 * 10 ** 9
    [(level, line)] = graph.log(node)  # of 20 messages
    assert level is LoggingSeverity.WARN
    assert line == (f'a time on /clock is ignored: {10 ** 9 * time.sec + time.nanosec} ns is not '
                    f'from 0 to {MAX_STAMP}; check its publisher')


def asked_for(type_):
    return [Parameter(name='number', value=ParameterValue(type=2, integer_value=7)),
            Parameter(name='number', value=ParameterValue(type=type_, integer_value=8))]


@pytest.mark.parametrize('type_', [10, 200])
def test_values_of_no_type_are_rejected(graph, node, type_):
    reason = f'a value has type {type_}, which no parameter of ROS has'
    answer = graph.call(node, SetParameters, '/probe/set_parameters',
                        SetParameters.Request(parameters=asked_for(type_)))
    assert [(each.successful, each.reason) for each in answer.results] == 2 * [(False, reason)]
    answer = graph.call(node, SetParametersAtomically, '/probe/set_parameters_atomically',
                        SetParametersAtomically.Request(parameters=asked_for(type_)))
    assert (answer.result.successful, answer.result.reason) == (False, reason)
    assert node.get_parameter('number').value == 1


def test_other_values_are_set(graph, node):
    answer = graph.call(node, SetParameters, '/probe/set_parameters',
                        SetParameters.Request(parameters=asked_for(2)))
    assert [each.successful for each in answer.results] == [True, True]
    assert node.get_parameter('number').value == 8
