# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages and TF of the base: contracts that the consumers rely on."""

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.base_odometry import BaseMotion, BaseState, BaseUpdate
from aick_ros.ros.conversions import from_pose, from_transform, to_stamp
from aick_ros.ros.output.publisher import OdometryPublisher
from aick_ros.settings.node import NodeSettings

T_ODOM_BASE = se3.exp([1.0, -2.0, 0.5, 0.3, -0.2, 1.1])
UNKNOWN = 9999.0 * np.eye(6)


def covariance(seed):
    """A covariance of six correlated numbers."""
    factor = np.random.default_rng(seed).normal(0, 0.05, (6, 6))
    return factor @ factor.T


def base(state=BaseState.TRACKED, stamp=1, pose=T_ODOM_BASE, sigma=covariance(0), moves=True):
    """The base at a frame, after a motion over 0.25 s unless it is lost."""
    is_tracked = state is BaseState.TRACKED and moves
    return BaseUpdate(stamp, state, PoseWithCovariance(pose, sigma), BaseMotion(
        np.array([0.1, -0.2, 0.3, -0.4, 0.5, -0.6]), covariance(1), 0.25) if is_tracked else None)


class Probe:
    """The real publisher, and subscribers of what it sends."""

    def __init__(self, guess=None, **settings):
        self.node = rclpy.create_node('probe')
        self.executor = SingleThreadedExecutor()  # that of rclpy outlives its context
        self.executor.add_node(self.node)
        self.odom, self.poses, self.links = [], [], []
        self.node.create_subscription(Odometry, 'odom', self.odom.append, 10)
        self.node.create_subscription(
            PoseWithCovarianceStamped, 'pose', self.poses.append, 10)
        if settings.get('publish_tf', False):
            tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
            self.node.create_subscription(
                tf2_msgs.TFMessage, '/tf', lambda m: self.links.extend(m.transforms), 10)
        publisher = OdometryPublisher(
            self.node, NodeSettings(**{'publish_tf': False, **settings}), guess)
        self.publish, self.reset = publisher.publish, publisher.reset

    def sent(self, *updates):
        """Publish updates of ascending stamps; return the odometry when the last one came."""
        for update in updates:
            self.publish(update)
        return self.receive(self.odom, updates[-1].stamp)

    def receive(self, messages, stamp):
        for _ in range(1200):
            if messages and to_stamp(messages[-1].header.stamp) == stamp:
                return messages[-1]
            self.executor.spin_once(timeout_sec=0.1)
        raise AssertionError('nothing was received')


@pytest.fixture
def probe(ros):
    """Make a publisher by its settings."""
    probes = []

    def make(**options):
        probes.append(Probe(**options))
        return probes[-1]

    yield make
    for made in probes:
        made.executor.shutdown()
        made.node.destroy_node()


def matrix(block):
    return np.reshape(block.covariance, (6, 6))


def twist_of(message):
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    return np.array([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])


def test_a_tracked_base_is_sent_with_its_motion(probe):
    made = probe(frame_id='body', odom_frame_id='start')
    sent = made.sent(base(stamp=1_234_567_890))
    assert (sent.header.frame_id, sent.child_frame_id) == ('start', 'body')
    assert to_stamp(sent.header.stamp) == 1_234_567_890
    np.testing.assert_allclose(from_pose(sent.pose.pose), T_ODOM_BASE, atol=1e-12)
    np.testing.assert_allclose(matrix(sent.pose), covariance(0), rtol=1e-12)
    np.testing.assert_allclose(twist_of(sent), [0.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    pose = made.receive(made.poses, 1_234_567_890)
    assert (pose.header, pose.pose) == (sent.header, sent.pose)


@pytest.mark.parametrize('kind, factor', [('velocity', 0.25 ** -2), ('increment', 1.0)])
def test_the_covariance_of_the_twist_is_that_of_velocity_or_increment(probe, kind, factor):
    """Of the velocity as nav_msgs defines it, or of the increment as RTAB-Map reads it."""
    sent = probe(twist_covariance=kind).sent(base())
    np.testing.assert_allclose(matrix(sent.twist), factor * covariance(1), rtol=1e-12)


def test_a_tracked_camera_is_never_taken_for_a_lost_one(probe):
    """However far the uncertainty has grown, each variance stays below 9999."""
    sent = matrix(probe().sent(base(sigma=1e6 * np.diag([1, 2, 3, 4, 5, 6.0]))).pose)
    np.testing.assert_allclose(sent, 0.99 * UNKNOWN)


def test_what_is_unknown_about_one_axis_leaves_the_others_as_they_are(probe):
    """A pose set with a direction that is not known; the correlations are kept."""
    grown = np.diag([1, 1, 1, 1e3, 1e4, 1e5]) @ (covariance(0) / 0.05 ** 2) @ np.diag(
        [1, 1, 1, 1e3, 1e4, 1e5])
    sent = matrix(probe().sent(base(sigma=grown)).pose)
    np.testing.assert_allclose(sent[:3, :3], grown[:3, :3], rtol=1e-12)
    np.testing.assert_allclose(np.diag(sent)[3:], 0.99 * 9999)
    for found in (sent, grown):
        found /= np.sqrt(np.outer(np.diag(found), np.diag(found)))
    np.testing.assert_allclose(sent, grown, rtol=1e-9)


def test_without_a_motion_the_twist_is_zero_and_unknown(probe):
    sent = probe().sent(base(moves=False))
    assert not twist_of(sent).any()
    np.testing.assert_array_equal(matrix(sent.twist), UNKNOWN)
    np.testing.assert_allclose(matrix(sent.pose), covariance(0), rtol=1e-12)


def test_after_a_loss_the_first_pose_is_unknown(probe):
    sent = probe().sent(base(BaseState.RECOVERED))
    np.testing.assert_allclose(from_pose(sent.pose.pose), T_ODOM_BASE, atol=1e-12)
    np.testing.assert_array_equal(matrix(sent.pose), UNKNOWN)
    np.testing.assert_array_equal(matrix(sent.twist), UNKNOWN)


NOT_MEASURED = pytest.mark.parametrize('state', [BaseState.LOST, BaseState.PREDICTED])


@NOT_MEASURED
def test_lost_with_the_policy_hold_is_the_last_pose_without_weight(probe, state):
    sent = probe().sent(base(state))
    np.testing.assert_allclose(from_pose(sent.pose.pose), T_ODOM_BASE, atol=1e-12)
    assert not twist_of(sent).any()
    np.testing.assert_array_equal(matrix(sent.pose), UNKNOWN)
    np.testing.assert_array_equal(matrix(sent.twist), UNKNOWN)


@NOT_MEASURED
def test_lost_with_the_policy_null_is_a_null_quaternion(probe, state):
    sent = probe(lost_policy='null').sent(base(state))
    q, p = sent.pose.pose.orientation, sent.pose.pose.position
    assert (q.x, q.y, q.z, q.w, p.x, p.y, p.z) == (0,) * 7
    np.testing.assert_array_equal(matrix(sent.pose), UNKNOWN)


@NOT_MEASURED
def test_lost_with_the_policy_silent_is_silence(probe, state):
    made = probe(lost_policy='silent')
    made.sent(base(stamp=1), base(state, stamp=2), base(stamp=3))
    assert [to_stamp(message.header.stamp) for message in made.odom] == [1, 3]


class Guess:
    """Another odometry of the base, which fails at one stamp."""

    def T_guess_base(self, stamp):
        return None if stamp == 4 else se3.exp([0.2 * stamp, 1.0, 0.0, 0.0, 0.0, -0.4])


def test_tf_places_the_base_and_stops_while_it_is_lost(probe):
    made = probe(publish_tf=True, frame_id='body', odom_frame_id='start')
    made.sent(base(stamp=1), base(BaseState.LOST, stamp=2), base(BaseState.RECOVERED, stamp=3))
    made.receive(made.links, 3)
    assert [to_stamp(link.header.stamp) for link in made.links] == [1, 3]
    for link in made.links:
        assert (link.header.frame_id, link.child_frame_id) == ('start', 'body')
        np.testing.assert_allclose(from_transform(link.transform), T_ODOM_BASE, atol=1e-12)


def test_without_a_frame_of_its_own_it_publishes_no_tf(probe):
    """The wheels publish odom -> base already; a second publisher would contradict them."""
    made = probe(guess=Guess(), publish_tf=True, guess_frame_id='odom')
    made.sent(base(stamp=1))
    assert made.node.count_publishers('/tf') == 0


@pytest.mark.parametrize('publish_tf, guess, said', [
    (True, 'odom', True), (False, 'odom', False), (True, 'wheels', False), (True, '', False)])
def test_that_it_publishes_no_tf_is_said_where_it_was_asked_to(
        graph, publish_tf, guess, said):
    node = graph.node()
    OdometryPublisher(node, NodeSettings(publish_tf=publish_tf, guess_frame_id=guess))
    assert [text for _, text in graph.log(node)] == said * [
        'guess_frame_id is odom_frame_id, of which another node publishes TF: this one does not '
        '(set publish_tf to false to silence this)']
    assert {each.topic_name: (each.msg_type, each.qos_profile.depth) for each in node.publishers
            if each.topic_name in ('/odom', '/pose')} == {
                '/odom': (Odometry, 10), '/pose': (PoseWithCovarianceStamped, 10)}


def test_tf_to_the_guess_frame_places_the_base_too(probe):
    """
    TF chains odom -> guess -> base; while the pose is predicted it continues.

    So it does at stamp 4, where the guess is not known, with the last transform.
    """
    made = probe(guess=Guess(), publish_tf=True, guess_frame_id='wheels')
    made.sent(base(stamp=1), base(BaseState.PREDICTED, stamp=2), base(BaseState.LOST, stamp=3),
              base(stamp=4), base(stamp=5))
    made.receive(made.links, 5)
    assert [to_stamp(link.header.stamp) for link in made.links] == [1, 2, 4, 5]
    for link, known_at in zip(made.links, (1, 2, 2, 5)):
        assert (link.header.frame_id, link.child_frame_id) == ('odom', 'wheels')
        T_odom_base = from_transform(link.transform) @ Guess().T_guess_base(known_at)
        np.testing.assert_allclose(T_odom_base, T_ODOM_BASE, atol=1e-12)


def test_before_a_guess_is_known_and_after_a_reset_there_is_no_tf(probe):
    """The last transform would place the guess in an odom that is no more."""
    made = probe(guess=Guess(), publish_tf=True, guess_frame_id='wheels')
    made.sent(base(stamp=4), base(stamp=3))
    made.reset()
    made.sent(base(stamp=4), base(stamp=5))
    made.receive(made.links, 5)
    assert [to_stamp(link.header.stamp) for link in made.links] == [3, 5]
