# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a node with the settings does with arguments, and with changes."""

import threading
import time
from contextlib import suppress

import pytest
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.ros.arguments import Arguments
from aick_ros.ros.parameter_node import ParameterNode


@pytest.fixture
def make(ros_domain):
    """Return a function that makes a node, with words of the command line."""
    nodes = []

    def make(arguments=Arguments(), *words):
        rclpy.init(args=['--ros-args', *words] if words else [])
        nodes.append(ParameterNode(arguments))
        return nodes[-1]

    yield make
    for node in nodes:
        node.get_logger().set_level(LoggingSeverity.INFO)
        node.close()
    rclpy.try_shutdown()


def set_one(node, name, value):
    return node.set_parameters_atomically([Parameter(name, value=value)])


def test_before_the_declaration_ros_stores_what_it_is_given(make):
    node = make(Arguments(), '-p', 'aick.alpha:=0.7')
    assert node.get_name() == 'odom_node'
    assert set_one(node, 'aick.alpha', 0.8).successful
    assert node.declare().core.aick.alpha == 0.8


def test_parameters_are_declared_once_and_changes_are_those_of_the_settings(make):
    node = make()
    settings = node.declare()
    assert node.declare() is settings
    assert set_one(node, 'aick.alpha', 0.7).successful
    rejected = set_one(node, 'aick.alpha', 7.0)
    assert not rejected.successful and 'aick.alpha' in rejected.reason
    assert (settings.core.aick.alpha, node.get_parameter('aick.alpha').value) == (0.7, 0.7)


@pytest.mark.parametrize('read_only', [True, False])
def test_what_is_read_once_may_be_read_only(make, read_only):
    node = make()
    node.declare(read_only)
    assert node.describe_parameter('frame_id').read_only is read_only
    assert not node.describe_parameter('aick.alpha').read_only


def test_a_rejected_declaration_may_be_repeated(make):
    node = make(Arguments(), '-p', 'aick.alpha:=7.0')
    with pytest.raises(InputError, match='aick.alpha'):
        node.declare()
    assert set_one(node, 'aick.alpha', 0.6).successful
    assert node.declare().core.aick.alpha == 0.6


def test_after_a_rejected_declaration_the_bad_one_is_named_until_it_is_corrected(make):
    node = make(Arguments(), '-p', 'aick.alpha:=7.0')
    with pytest.raises(InputError):
        node.declare(read_only=False)
    rejected = set_one(node, 'lost_policy', 'null')
    assert not rejected.successful
    assert rejected.reason.startswith(
        'this is to be corrected first: aick.alpha = 7.0 is outside 0 to 1')
    assert not set_one(node, 'of_no_node', 1).successful
    assert set_one(node, 'aick.alpha', 0.6).successful
    assert set_one(node, 'lost_policy', 'null').successful
    assert 'frame_id' in set_one(node, 'frame_id', 5).reason
    settings = node.declare(read_only=False)
    assert (settings.core.aick.alpha, settings.own.lost_policy) == (0.6, 'null')


def test_parameters_of_rgbd_odometry_from_the_command_line_count(make):
    node = make(Arguments({'Reg/Force3DoF': 'true'}))
    assert node.declare().core.odometry.planar


@pytest.mark.parametrize('level', ['debug', 'error'])
def test_the_level_of_the_log_is_that_of_the_arguments(make, level):
    node = make(Arguments(level=level))
    assert node.get_logger().get_effective_level() == LoggingSeverity[level.upper()]


def test_a_value_without_a_type_is_one_sentence(make):
    with pytest.raises(InputError, match='a parameter is an empty list or has no value'):
        make(Arguments(), '-p', 'x:=[]')


def test_arguments_of_the_slam_node_are_said_to_change_nothing(make, capfd):
    make(Arguments(of_slam=('-d', '--delete_db_on_start')))
    text = ''.join(capfd.readouterr())
    assert text.count('changes nothing here') == 2
    assert 'argument -d is one' in text and 'argument --delete_db_on_start is one' in text


@pytest.mark.parametrize('error, sentence', [
    (ZeroDivisionError('of ours'), 'a request failed, please report this:'),
    (InputError('two types on a topic'), '[odom_node]: two types on a topic')], ids=repr)
def test_a_callback_that_fails_does_not_end_it(make, capfd, error, sentence):
    node, calls = make(), []

    def fail():
        calls.append(None)
        if len(calls) < 3:
            raise error
        node.context.try_shutdown()

    node.create_timer(0.01, fail)
    with suppress(ExternalShutdownException):
        node.run()
    assert len(calls) == 3
    text = ''.join(capfd.readouterr())
    assert text.count(sentence) == 1  # of two
    assert ('ZeroDivisionError: of ours' in text) is (type(error) is ZeroDivisionError)


def test_a_failure_that_follows_from_the_shutdown_ends_it(make, capfd):
    node = make()

    def fail():
        node.context.try_shutdown()
        raise ZeroDivisionError

    node.create_timer(0.01, fail)
    with pytest.raises((ZeroDivisionError, ExternalShutdownException)):
        node.run()
    assert capfd.readouterr().err == ''


def test_it_ends_even_if_nothing_wakes_it_after_the_shutdown(make):
    """A signal wakes rclpy's executor before the context is shut down, once."""
    node = make()

    def run():
        with pytest.raises(ExternalShutdownException):
            node.run()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    time.sleep(0.3)  # until it waits
    node.context.handle.shutdown()  # as rclpy's handler does it, which calls nothing of Python's
    thread.join(60)
    assert not thread.is_alive()
