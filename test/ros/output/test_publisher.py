# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is published of an update: contracts that the consumers rely on."""

import dataclasses

import numpy as np
import pytest
import rclpy
from nav_msgs.msg import Odometry as OdometryMessage

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import Odometry
from aick_ros.odometry.base_odometry import BaseOdometry
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import from_pose
from aick_ros.ros.output.publisher import OdometryPublisher
from aick_ros.settings.node import NodeSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource


@pytest.fixture(scope='module')
def updates():
    source, odometry = SyntheticSource(SyntheticOptions(seed=5, frames=2)), Odometry()
    return [odometry.register_frame(source.frame(i)) for i in range(2)]


class Probe:
    """The real publisher, and a subscriber of what it sends."""

    def __init__(self, **settings):
        self.node, self.received = rclpy.create_node('probe'), []
        self.node.create_subscription(OdometryMessage, 'odom', self.received.append, 10)
        self.publisher = OdometryPublisher(self.node, NodeSettings(publish_tf=False, **settings))

    def __call__(self, update, T_base_camera=np.eye(4)):
        self.received.clear()
        if not self.publisher.publish(update, T_base_camera):
            return None
        for _ in range(100):
            if self.received:
                return self.received[0]
            rclpy.spin_once(self.node, timeout_sec=0.1)
        raise AssertionError('nothing was received')


@pytest.fixture
def make_probe(ros_domain):
    rclpy.init(args=[])
    probes = []

    def make(**settings):
        probes.append(Probe(**settings))
        return probes[-1]

    yield make
    for probe in probes:
        probe.node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def publish(make_probe):
    """Publish an update with the real publisher; return the odometry that is received."""
    return make_probe()


def test_a_tracked_camera_is_never_taken_for_a_lost_one(publish, updates):
    """However far the uncertainty has grown, the first variance stays below 9999."""
    far = dataclasses.replace(updates[1], pose=PoseWithCovariance(
        updates[1].T_odom_camera, 1e6 * np.diag([1, 2, 3, 4, 5, 6.0])))
    sent = np.reshape(publish(far).pose.covariance, (6, 6))
    assert sent.max() < 9999
    np.testing.assert_allclose(sent / sent[0, 0], np.diag([1, 2, 3, 4, 5, 6.0]))


def test_small_covariances_are_sent_as_they_are(publish, updates):
    sent = np.reshape(publish(updates[1]).pose.covariance, (6, 6))
    np.testing.assert_allclose(sent, updates[1].pose.covariance, rtol=1e-9, atol=1e-15)


def test_of_a_bad_stamp_nothing_is_sent(publish, updates):
    assert publish(dataclasses.replace(updates[1], status=Status.BAD_STAMP)) is None


def lost(update):
    return dataclasses.replace(update, status=Status.TOO_FEW_MATCHES, reason='3 matches')


def test_lost_with_the_policy_null_is_a_null_quaternion(make_probe, updates):
    publish = make_probe(lost_policy='null')
    publish(updates[1])
    pose = publish(lost(updates[1])).pose
    q, p = pose.pose.orientation, pose.pose.position
    assert (q.x, q.y, q.z, q.w, p.x, p.y, p.z) == (0,) * 7
    assert np.diag(np.reshape(pose.covariance, (6, 6))).tolist() == [9999.0] * 6


def test_lost_with_the_policy_silent_is_silence(make_probe, updates):
    publish = make_probe(lost_policy='silent')
    publish(updates[1])
    assert publish(lost(updates[1])) is None
    assert publish(updates[1]) is not None


def test_the_covariance_of_the_twist_as_rtabmap_reads_it(make_probe, updates):
    """That of the increment: by the square of the interval less than the velocity's."""
    velocity, increment = (
        np.reshape(make_probe(twist_covariance=kind)(updates[1]).twist.covariance, (6, 6))
        for kind in ('velocity', 'increment'))
    np.testing.assert_allclose(increment, velocity * updates[1].increment.interval ** 2, rtol=1e-6)
    np.testing.assert_allclose(
        np.linalg.eigvalsh(increment),
        np.linalg.eigvalsh(updates[1].increment.pose.covariance), rtol=1e-6)


def test_the_initial_pose_is_that_of_the_base(make_probe, updates):
    publish = make_probe(initial_pose=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3))
    T = se3.from_roll_pitch_yaw(0.1, 0.2, 0.3, (1.0, 2.0, 3.0))
    for update in updates:
        np.testing.assert_allclose(from_pose(publish(update).pose.pose), T @ update.T_odom_camera,
                                   atol=1e-12)


@pytest.mark.parametrize('numbers', [(1.0, 2.0), (0.0,) * 7, (np.nan,) * 6])
def test_an_initial_pose_that_is_none_is_refused(make_probe, numbers):
    with pytest.raises(InputError, match='it takes x y z .m. roll pitch yaw .rad.'):
        make_probe(initial_pose=numbers)


def test_a_corrected_extrinsic_does_not_move_the_path(make_probe, updates):
    publish = make_probe()
    before = publish(updates[1])
    after = publish(updates[1], se3.exp([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
    np.testing.assert_allclose(from_pose(after.pose.pose), from_pose(before.pose.pose),
                               atol=1e-12)


@pytest.mark.parametrize('kind', ['velocity', 'increment'])
def test_the_twist_of_a_camera_beside_the_base_is_that_of_the_base(make_probe, updates, kind):
    T_base_camera = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.3, -0.2, 0.5))
    sent = make_probe(twist_covariance=kind)(updates[1], T_base_camera).twist
    motion = BaseOdometry().update(updates[1], T_base_camera).motion
    linear, angular = sent.twist.linear, sent.twist.angular
    np.testing.assert_allclose([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z],
                               motion.twist, atol=1e-12)
    np.testing.assert_allclose(
        np.reshape(sent.covariance, (6, 6)),
        motion.twist_covariance if kind == 'velocity' else motion.covariance, atol=1e-12)
