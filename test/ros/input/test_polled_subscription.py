# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages that are taken together, over DDS."""

from rclpy.qos import QoSProfile
from std_msgs.msg import Int32

from aick_ros.ros.input.polled_subscription import PolledSubscription


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
