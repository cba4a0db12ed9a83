# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node under test, other nodes that publish, and what was logged."""

import re
import time
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from aick_ros.ros.conversions import to_time, transform_stamped


class FakeSubscription:
    """A subscription with a queue, from which the test or the code under test takes."""

    def __init__(self, kind, topic, callback, qos):
        self.msg_type, self.topic_name, self.qos_profile = kind, topic, qos
        self.callback = callback
        self.raw, self.queue, self.handle = False, [], self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def take_message(self, kind, raw):
        assert (kind, raw) == (self.msg_type, self.raw)
        return (self.queue.pop(0), {}) if self.queue else None

    def execute(self):
        """Take one message as the executor does, if there is one."""
        taken = self.take_message(self.msg_type, self.raw)
        if taken is not None:
            self.callback(taken[0])


class FakeLogger:
    """
    Keeps what was logged.

    :ivar options: those of each text, as how often it may be repeated.
    """

    def __init__(self):
        self.warnings, self.infos, self.options = [], [], {}

    def warning(self, text, **options):
        self.warnings.append(text)
        self.options[text] = options

    def info(self, text, **options):
        self.infos.append(text)
        self.options[text] = options


class FakeNode:
    """
    What the inputs ask of a node.

    :ivar publishers: dictionary from topics to the endpoints of their publishers.
    :ivar now: time of the node's clock [ns].
    """

    def __init__(self):
        self.subscriptions, self.publishers, self.logger = [], {}, FakeLogger()
        self.now = 10 ** 18

    def publish(self, topic, reliability=ReliabilityPolicy.RELIABLE,
                durability=DurabilityPolicy.VOLATILE, node_name='camera', kind=None):
        """Add a publisher with a QoS."""
        self.publishers.setdefault(topic, []).append(SimpleNamespace(
            node_name=node_name, topic_type=kind, qos_profile=QoSProfile(
                depth=10, reliability=reliability, durability=durability)))

    def resolve_topic_name(self, name):
        return '/' + name.lstrip('/')

    def create_subscription(self, kind, topic, callback, qos, event_callbacks=None,
                            callback_group=None):
        self.subscriptions.append(FakeSubscription(kind, topic, callback, qos))
        self.subscriptions[-1].events, self.subscriptions[-1].group = (
            event_callbacks, callback_group)
        return self.subscriptions[-1]

    def destroy_subscription(self, subscription):
        self.subscriptions.remove(subscription)

    def get_publishers_info_by_topic(self, topic):
        return self.publishers.get(topic, [])

    def count_publishers(self, topic):
        return len(self.get_publishers_info_by_topic(topic))

    def get_topic_names_and_types(self):
        return [(topic, [endpoint.topic_type for endpoint in endpoints])
                for topic, endpoints in self.publishers.items()]

    def get_logger(self):
        return self.logger

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self.now))


@pytest.fixture
def fake_node():
    return FakeNode()


PATIENCE = 60.0  # seconds that nothing takes, even on a loaded machine


def wait_until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


@pytest.fixture
def node(ros_context):
    """Return a node, with nobody else."""
    made = rclpy.create_node('probe', context=ros_context)
    wait_until(lambda: {topic for topic, _ in made.get_topic_names_and_types()} <= {
        '/parameter_events', '/rosout'})
    yield made
    made.destroy_node()


class Neighbours:
    """Other nodes, whose publishers the node under test has found once they are returned."""

    wait_until = staticmethod(wait_until)

    def __init__(self, node):
        self._node, self._others = node, {}

    def offer(self, topic, reliability=ReliabilityPolicy.RELIABLE,
              durability=DurabilityPolicy.VOLATILE, name='camera', kind=Image):
        """Make a publisher of the node of a name."""
        if name not in self._others:
            self._others[name] = rclpy.create_node(name, context=self._node.context)
        before = self._node.count_publishers(topic)
        publisher = self._others[name].create_publisher(kind, topic, QoSProfile(
            depth=100, reliability=reliability, durability=durability))
        self.wait_until(lambda: self._node.count_publishers(topic) > before)
        return publisher

    def withdraw(self, publisher):
        """Destroy a publisher."""
        topic = publisher.topic_name
        before = self._node.count_publishers(topic)
        [owner] = [other for other in self._others.values() if publisher in other.publishers]
        owner.destroy_publisher(publisher)
        self.wait_until(lambda: self._node.count_publishers(topic) < before)

    def send(self, publisher, *messages):
        """
        Publish messages; they wait in the queues of the subscriptions when this returns.

        Within a process Fast DDS puts a message into the queues itself while it is published.
        """
        self.wait_until(publisher.get_subscription_count)
        for message in messages:
            publisher.publish(message)

    def close(self):
        for other in self._others.values():
            other.destroy_node()


@pytest.fixture
def neighbours(node):
    made = Neighbours(node)
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
    """Lines of the log on stderr."""

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
        self._text += self._capfd.readouterr().err
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
    for module in ('assembler', 'imu', 'pairing', 'subscriptions', 'watchdog'):
        monkeypatch.setattr(f'aick_ros.ros.input.{module}.time', clock)
    return clock
