# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node under test, other nodes that publish, and what was logged."""

import re

import pytest
import rclpy
from rclpy.qos import (
    DurabilityPolicy, QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible)
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from aick_ros.ros.conversions import to_time, transform_stamped


@pytest.fixture
def node(ros_context, wait_until):
    """Return a node, with nobody else."""
    made = rclpy.create_node('probe', context=ros_context)
    wait_until(lambda: {topic for topic, _ in made.get_topic_names_and_types()} <= {
        '/parameter_events', '/rosout'}, 'the nodes of another test to be gone')
    yield made
    made.destroy_node()


class Neighbours:
    """Other nodes, whose publishers the node under test has found once they are returned."""

    def __init__(self, node, wait_until):
        self._node, self._others, self.wait_until = node, {}, wait_until

    def offer(self, topic, reliability=ReliabilityPolicy.RELIABLE,
              durability=DurabilityPolicy.VOLATILE, name='camera', kind=Image):
        """Make a publisher of the node of a name."""
        if name not in self._others:
            self._others[name] = rclpy.create_node(name, context=self._node.context)
        before = self._node.count_publishers(topic)
        publisher = self._others[name].create_publisher(kind, topic, QoSProfile(
            depth=100, reliability=reliability, durability=durability))
        self.wait_until(lambda: self._node.count_publishers(topic) > before, topic)
        return publisher

    def withdraw(self, publisher):
        """Destroy a publisher."""
        topic = publisher.topic_name
        before = self._node.count_publishers(topic)
        [owner] = [other for other in self._others.values() if publisher in other.publishers]
        owner.destroy_publisher(publisher)
        self.wait_until(lambda: self._node.count_publishers(topic) < before, f'{topic} to end')

    def send(self, publisher, *messages):
        """
        Publish messages; they wait in the queues of the subscriptions when this returns.

        Within a process Fast DDS puts a message into the queues while it is published.
        """
        self.wait_until(lambda: self._has_matched(publisher), publisher.topic_name)
        for message in messages:
            publisher.publish(message)

    def close(self):
        for other in self._others.values():
            other.destroy_node()

    def _has_matched(self, publisher):
        """Return whether it and the subscriptions that can receive from it know each other."""
        receivers = [each for each in self._node.subscriptions
                     if each.topic_name == publisher.topic_name
                     and can_receive(each, publisher.qos_profile)]
        offers = self._node.get_publishers_info_by_topic(publisher.topic_name)
        return receivers and publisher.get_subscription_count() == len(receivers) and all(
            each.get_publisher_count() == sum(can_receive(each, offer.qos_profile)
                                              for offer in offers) for each in receivers)


def can_receive(subscription, offered):
    compatibility, _ = qos_check_compatible(offered, subscription.qos_profile)
    return compatibility != QoSCompatibility.ERROR


@pytest.fixture
def neighbours(node, wait_until):
    made = Neighbours(node, wait_until)
    yield made
    made.close()


@pytest.fixture
def tell_tf(node):
    """Return a function that has the node take {(parent, child): T_parent_child} from TF."""
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')

    def tell(links, topic='/tf_static', stamp=0):
        [subscription] = [each for each in node.subscriptions if each.topic_name == topic]
        subscription.callback(tf2_msgs.TFMessage(transforms=[
            transform_stamped(stamp, *frames, T) for frames, T in links.items()]))
    return tell


class Log:
    """Lines of the log on stderr or, as ROS may be set to, on stdout."""

    def __init__(self, node, capfd):
        self._node, self._capfd, self._text = node, capfd, ''

    @property
    def warnings(self):
        return self._of('WARN')

    @property
    def infos(self):
        return self._of('INFO')

    @property
    def throttles(self):
        """Shortest times between two lines of what was logged with a limit [s]."""
        return [limits['throttle_duration_sec']
                for limits in self._node.get_logger().contexts.values()
                if 'throttle_duration_sec' in limits]

    def _of(self, level):
        self._text += ''.join(self._capfd.readouterr())
        return re.findall(rf'\[{level}\] \[[0-9.]+\] \[probe\]: (.*)', self._text)


@pytest.fixture
def log(node, capfd):
    """Return what the node logs."""
    return Log(node, capfd)


@pytest.fixture
def stamped():
    """Return a function from a stamp [ns] to an image with nothing but a header."""
    def message(stamp, frame_id='camera'):
        return Image(header=Header(stamp=to_time(stamp), frame_id=frame_id))
    return message


class Steady:
    """Python's steady clock, which stands still unless the test sets ``now``."""

    now = 1000.0

    def monotonic(self):
        return self.now


@pytest.fixture
def steady(monkeypatch):
    """Return the steady clock of the inputs: no test waits for seconds of silence."""
    clock = Steady()
    for module in ('assembler', 'calibration', 'imu', 'pairing', 'subscriptions', 'watchdog'):
        monkeypatch.setattr(f'aick_ros.ros.input.{module}.time', clock)
    return clock
