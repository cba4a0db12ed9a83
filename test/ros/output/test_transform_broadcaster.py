# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The message on /tf against the transform that is sent."""

import numpy as np
import pytest
from rclpy.logging import LoggingSeverity

from aick_ros.geometry import se3
from aick_ros.ros.conversions import from_transform, to_stamp
from aick_ros.ros.output import transform_broadcaster
from aick_ros.ros.output.transform_broadcaster import TransformBroadcaster


def test_a_transform_arrives_as_it_is(graph):
    messages = pytest.importorskip('tf2_msgs.msg')
    node, pose = graph.node(namespace='robot'), se3.exp([1.0, -2.0, 3.0, 0.3, -0.2, 0.1])
    broadcaster = TransformBroadcaster(node)
    [depth] = [each.qos_profile.depth for each in node.publishers if each.topic_name == '/tf']
    assert depth == 100
    received = graph.listen(messages.TFMessage, '/tf')
    broadcaster.send(5_000_000_007, 'odom', 'base', pose)
    graph.wait_until(lambda: received, 'the transform')
    [message] = received[0].transforms
    assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base')
    assert to_stamp(message.header.stamp) == 5_000_000_007
    np.testing.assert_allclose(from_transform(message.transform), pose, atol=1e-12)
    assert graph.log(node) == []


def test_without_tf2_nothing_is_sent_and_that_is_said_once(graph, monkeypatch):
    monkeypatch.setattr(transform_broadcaster, 'TFMessage', None)
    node = graph.node()
    broadcaster = TransformBroadcaster(node)
    for _ in range(2):
        broadcaster.send(1, 'odom', 'base', np.eye(4))
    assert '/tf' not in [each.topic_name for each in node.publishers]
    [(level, text)] = graph.log(node)
    assert level is LoggingSeverity.WARN and 'set publish_tf to false' in text
