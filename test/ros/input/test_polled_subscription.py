# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages that are taken together, over DDS."""

from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Int32

from aick_ros.ros.input.polled_subscription import PolledSubscription


def taken_from(polled):
    return [deserialize_message(message, Int32).data for message in polled.take()]


def test_it_is_left_to_whoever_takes_the_messages(node, neighbours):
    """No executor takes them, though it runs what was ready after them."""
    polled = PolledSubscription(node, Int32, 'numbers', QoSProfile(depth=7))
    [made] = node.subscriptions
    assert (made.msg_type, made.topic_name, made.qos_profile.depth) == (Int32, '/numbers', 7)
    assert made.callback_group.can_execute(made) is False
    assert made.callback_group.beginning_execution(made) is False
    assert made.callback_group.ending_execution(made) is None
    assert made.callback(Int32(data=1)) is None
    publisher = neighbours.offer('numbers', kind=Int32)
    neighbours.send(publisher, Int32(data=2), Int32(data=3))
    executor, rounds = SingleThreadedExecutor(context=node.context), []
    executor.add_node(node)
    node.create_timer(0.0, lambda: rounds.append(1))
    neighbours.wait_until(lambda: len(rounds) > 9, 'the timer',
                          lambda: executor.spin_once(timeout_sec=1.0))
    executor.shutdown()
    assert taken_from(polled) == [2, 3]
    assert polled.take() == []
    polled.destroy()
    assert list(node.subscriptions) == []


def test_it_keeps_as_many_messages_as_its_qos_says_and_the_newest(node, neighbours):
    polled = PolledSubscription(node, Int32, 'numbers', QoSProfile(
        depth=7, reliability=ReliabilityPolicy.BEST_EFFORT))
    [made] = node.subscriptions
    assert made.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    neighbours.send(neighbours.offer('numbers', kind=Int32),
                    *(Int32(data=number) for number in range(10)))
    assert taken_from(polled) == list(range(3, 10))


def test_messages_wait_in_order_until_they_are_taken(rig):
    publisher = rig.node.create_publisher(Int32, 'numbers', 10)
    polled = PolledSubscription(rig.node, Int32, 'numbers', QoSProfile(depth=10))
    rig.wait_until(publisher.get_subscription_count, 'the subscription')
    for number in range(5):
        publisher.publish(Int32(data=number))
    taken = []

    def have_come():
        taken.extend(taken_from(polled))
        return len(taken) == 5

    rig.wait_until(have_come, lambda: taken)
    assert taken == [0, 1, 2, 3, 4]
    assert polled.take() == []
    polled.destroy()
    rig.wait_until(lambda: not publisher.get_subscription_count(), 'the end of the subscription')
