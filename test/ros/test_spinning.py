# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Callbacks on a thread of their own, and their errors."""

import threading

import pytest
import rclpy
from std_msgs.msg import Empty

from aick_ros.ros.spinning import spinning


def trigger(node, callback):
    """Have a callback done as soon as the node spins."""
    node.create_guard_condition(callback).trigger()


def test_callbacks_are_done_beside_the_block_and_the_node_is_destroyed_after_it(ros):
    node, done, threads = rclpy.create_node('probe'), threading.Event(), []

    def callback():
        threads.append(threading.get_ident())
        done.set()

    node.create_publisher(Empty, 'x', 1)
    with spinning(node) as spin:
        trigger(node, callback)
        assert done.wait(60) and not spin.done()
        assert len(list(node.publishers)) > 0
    assert spin.done() and threads[0] != threading.get_ident()
    assert list(node.publishers) == []


def test_an_error_of_a_callback_ends_the_spinning_and_is_raised_after_the_block(ros):
    node, steps = rclpy.create_node('probe'), []

    def callback():
        raise KeyError('of the callback')

    with pytest.raises(KeyError, match='of the callback'):
        with spinning(node) as spin:
            trigger(node, callback)
            assert isinstance(spin.exception(60), KeyError)
            steps.append('after it')
    assert steps == ['after it'] and list(node.publishers) == []


def test_an_error_of_the_block_comes_through(ros):
    with pytest.raises(ZeroDivisionError):
        with spinning(rclpy.create_node('probe')):
            raise ZeroDivisionError


def test_the_end_of_ros_is_no_error(ros):
    with spinning(rclpy.create_node('probe')) as spin:
        rclpy.shutdown()
        spin.result(60)
