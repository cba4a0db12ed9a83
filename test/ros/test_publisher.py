# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is published of an update: contracts that the consumers rely on."""

import dataclasses

import numpy as np
import pytest
import rclpy
from nav_msgs.msg import Odometry as OdometryMessage

from aick_ros.odometry import Odometry
from aick_ros.ros.publisher import OdometryPublisher
from aick_ros.settings import NodeSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.status import Status


@pytest.fixture(scope='module')
def updates():
    source, odometry = SyntheticSource(SyntheticOptions(seed=5, frames=2)), Odometry()
    return [odometry.register_frame(source.frame(i)) for i in range(2)]


@pytest.fixture
def publish(ros_domain):
    """Publish an update with the real publisher; return the odometry that is received."""
    rclpy.init(args=[])
    node, received = rclpy.create_node('probe'), []
    node.create_subscription(OdometryMessage, 'odom', received.append, 10)
    publisher = OdometryPublisher(node, NodeSettings(publish_tf=False))

    def publish(update):
        received.clear()
        if not publisher.publish(update, np.eye(4)):
            return None
        for _ in range(100):
            if received:
                return received[0]
            rclpy.spin_once(node, timeout_sec=0.1)
        raise AssertionError('nothing was received')

    yield publish
    node.destroy_node()
    rclpy.shutdown()


def test_a_tracked_camera_is_never_taken_for_a_lost_one(publish, updates):
    """However far the uncertainty has grown, the first variance stays below 9999."""
    far = dataclasses.replace(updates[1], covariance=1e6 * np.diag([1, 2, 3, 4, 5, 6.0]))
    sent = np.reshape(publish(far).pose.covariance, (6, 6))
    assert sent.max() < 9999
    np.testing.assert_allclose(sent / sent[0, 0], np.diag([1, 2, 3, 4, 5, 6.0]))


def test_small_covariances_are_sent_as_they_are(publish, updates):
    sent = np.reshape(publish(updates[1]).pose.covariance, (6, 6))
    np.testing.assert_allclose(sent, updates[1].covariance, rtol=1e-9, atol=1e-15)


def test_of_a_bad_stamp_nothing_is_sent(publish, updates):
    assert publish(dataclasses.replace(updates[1], status=Status.BAD_STAMP)) is None
