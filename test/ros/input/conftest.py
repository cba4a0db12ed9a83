# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node without DDS, whose topics, publishers and clock are those of the test."""

from types import SimpleNamespace

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Header

from aick_ros.ros.conversions import to_time


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


@pytest.fixture
def stamped():
    """Return a function from a stamp [ns] to a message with nothing but a header."""
    def message(stamp, frame_id='camera'):
        return SimpleNamespace(header=Header(stamp=to_time(stamp), frame_id=frame_id), data=b'')
    return message


@pytest.fixture
def steady(monkeypatch):
    """Return the steady clock of the inputs, which stands still unless the test sets ``now``."""
    clock = SimpleNamespace(now=1000.0)
    clock.monotonic = lambda: clock.now
    for module in ('assembler', 'pairing', 'subscriptions', 'watchdog'):
        monkeypatch.setattr(f'aick_ros.ros.input.{module}.time', clock)
    return clock
