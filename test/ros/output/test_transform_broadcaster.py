# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The message on /tf against the transform that is sent."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.ros.conversions import from_transform, to_stamp
from aick_ros.ros.output import transform_broadcaster
from aick_ros.ros.output.transform_broadcaster import TransformBroadcaster


class FakeNode:
    """Keeps what is published and warned of."""

    def __init__(self):
        self.sent, self.warnings, self.publishers = [], [], []

    def create_publisher(self, kind, topic, qos):
        self.publishers.append((kind, topic, qos.depth))
        return SimpleNamespace(publish=self.sent.append)

    def get_logger(self):
        return SimpleNamespace(warning=self.warnings.append)


def test_a_transform_arrives_as_it_is():
    messages = pytest.importorskip('tf2_msgs.msg')
    node, pose = FakeNode(), se3.exp([1.0, -2.0, 3.0, 0.3, -0.2, 0.1])
    TransformBroadcaster(node).send(5_000_000_007, 'odom', 'base', pose)
    assert node.publishers == [(messages.TFMessage, '/tf', 100)]
    (message,), = [sent.transforms for sent in node.sent]
    assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base')
    assert to_stamp(message.header.stamp) == 5_000_000_007
    np.testing.assert_allclose(from_transform(message.transform), pose, atol=1e-12)
    assert node.warnings == []


def test_without_tf2_nothing_is_sent_and_that_is_said_once(monkeypatch):
    monkeypatch.setattr(transform_broadcaster, 'TFMessage', None)
    node = FakeNode()
    broadcaster = TransformBroadcaster(node)
    for _ in range(2):
        broadcaster.send(1, 'odom', 'base', np.eye(4))
    assert node.sent == node.publishers == []
    assert len(node.warnings) == 1 and 'set publish_tf to false' in node.warnings[0]
