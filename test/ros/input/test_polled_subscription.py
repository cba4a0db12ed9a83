# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages that are taken together, over DDS."""

from rclpy.callback_groups import CallbackGroup
from rclpy.qos import QoSProfile
from std_msgs.msg import Int32

from aick_ros.ros.input.polled_subscription import PolledSubscription


def test_it_is_left_to_whoever_takes_the_messages(fake_node):
    """No executor wakes up for it."""
    qos = QoSProfile(depth=7)
    polled = PolledSubscription(fake_node, Int32, 'numbers', qos)
    [made] = fake_node.subscriptions
    assert (made.msg_type, made.topic_name, made.qos_profile) == (Int32, 'numbers', qos)
    assert isinstance(made.group, CallbackGroup)
    assert made.group.can_execute(made) is False
    assert made.group.beginning_execution(made) is False
    assert made.group.ending_execution(made) is None
    assert made.callback(Int32(data=1)) is None
    made.queue += [Int32(data=2), Int32(data=3)]
    assert [message.data for message in polled.take()] == [2, 3]
    assert polled.take() == []
    polled.destroy()
    assert fake_node.subscriptions == []


def test_messages_wait_in_order_until_they_are_taken(rig):
    publisher = rig.node.create_publisher(Int32, 'numbers', 10)
    polled = PolledSubscription(rig.node, Int32, 'numbers', QoSProfile(depth=10))
    rig.wait_until(publisher.get_subscription_count, 'the subscription')
    for number in range(5):
        publisher.publish(Int32(data=number))
    taken = []

    def have_come():
        taken.extend(message.data for message in polled.take())
        return len(taken) == 5

    rig.wait_until(have_come, lambda: taken)
    assert taken == [0, 1, 2, 3, 4]
    assert polled.take() == []
    polled.destroy()
    rig.wait_until(lambda: not publisher.get_subscription_count(), 'the end of the subscription')
