# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conclusions of RTAB-Map, robot_localization and nav2 from the messages of the node."""

import math
from enum import Enum

import numpy as np
import pytest
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import Empty

from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, from_transform, to_stamp

COUNT, DARK = 16, range(6, 11)
FOUND = DARK.stop  # the first frame after the loss
EXTRINSIC = '[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]'
UNKNOWN = 9999.0


class Map(Enum):
    """Reaction of RTAB-Map to a message."""

    EXTENDED = 'the new place is linked to the last one'
    NEW = 'a new map is begun: the odometry was lost or has been reset'
    WAITS = 'nothing is done: TF does not know the stamp'


def is_null(message):
    q = message.pose.pose.orientation
    return (q.x, q.y, q.z, q.w) == (0.0, 0.0, 0.0, 0.0)


class RtabMap:
    """RTAB-Map with external odometry: TF at the stamp first, then the message."""

    def __init__(self, uses_tf=True):
        self._uses_tf = uses_tf
        self._lost, self._last = False, None
        self.link_covariances = []

    def take(self, message, links):
        """Return what becomes of the map; ``links``: stamp -> T_odom_base of /tf."""
        if self._uses_tf and to_stamp(message.header.stamp) not in links:
            return Map.WAITS
        variances = message.pose.covariance[0], message.twist.covariance[0]
        if is_null(message) or variances == (UNKNOWN, UNKNOWN):
            self._lost = True
            return Map.NEW
        pose = from_pose(message.pose.pose)
        at_origin = np.array_equal(pose, np.eye(4))
        reset = at_origin and self._last is not None and not np.array_equal(self._last, pose)
        was_lost, self._lost, self._last = self._lost, False, pose
        variance = variances[1]
        if variance != 1.0 and variance > 0.0 and math.isfinite(variance):
            self.link_covariances.append(np.reshape(message.twist.covariance, (6, 6)))
        return Map.NEW if was_lost or reset else Map.EXTENDED


class RobotLocalization:
    """The EKF of robot_localization, of positions only: it predicts rest and fuses the pose."""

    def __init__(self, odom_frame, base_frame):
        self._frames = odom_frame, base_frame
        self.position, self._variance = np.zeros(3), np.full(3, 1e-9)
        self.warnings = []

    def take(self, message):
        """Fuse a message; return how far the filter was pulled [m]."""
        assert (message.header.frame_id, message.child_frame_id) == self._frames
        if is_null(message):
            self.warnings.append('null quaternion taken for identity')
        covariance = np.reshape(message.pose.covariance, (6, 6))
        assert np.isfinite(covariance).all()
        assert (np.diag(covariance) > 0).all(), 'it would be replaced'
        if covariance[0, 0] > 1e3:
            self.warnings.append('very large covariance')
        p = message.pose.pose.position
        self._variance = self._variance + 1e-4  # process noise
        gain = self._variance / (self._variance + np.diag(covariance)[:3])
        pull = gain * (np.array([p.x, p.y, p.z]) - self.position)
        self.position = self.position + pull
        self._variance = (1.0 - gain) * self._variance
        return float(np.linalg.norm(pull))


class Nav2:
    """The controller reads the twist in the base frame, costmaps and slam_toolbox read TF."""

    def __init__(self, base_frame):
        self._base_frame = base_frame

    def speed(self, message):
        """Return the estimated forward speed [m/s]."""
        assert message.child_frame_id == self._base_frame
        return math.hypot(message.twist.twist.linear.x, message.twist.twist.linear.y)

    @staticmethod
    def can_place_scan(stamp, links):
        """Return whether a scan of a stamp finds its transform: between two of them."""
        return bool(links) and min(links) <= stamp <= max(links)


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:COUNT])


@pytest.fixture(scope='module')
def with_loss(frames, darken):
    return [darken(frame) if i in DARK else frame
            for i, frame in enumerate(frames)]


@pytest.fixture
def run(rig, start_node):
    """Play frames to a node; return its messages by stamp, and its transforms by stamp."""
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')

    def run(frames, reset_before=None, **parameters):
        rig.listen_to_tf()
        start_node(frame_id='base_link', camera_in_base=EXTRINSIC, **parameters)
        rig.send_camera_info(frames[0].camera)
        for i, frame in enumerate(frames):
            if i == reset_before:
                rig.answer(frames[i - 1].stamp)
                rig.call(Empty, '/odom_node/reset_odom')
            rig.send(frame)
        rig.answer(frames[-1].stamp)
        rig.wait_until(lambda: frames[-1].stamp in stamps_of(rig.links), 'the last transform')
        return ({to_stamp(message.header.stamp): message for message in rig.odom},
                {stamp: from_transform(link.transform)
                 for stamp, link in zip(stamps_of(rig.links), rig.links)})
    return run


def stamps_of(links):
    return [to_stamp(link.header.stamp) for link in links]


def maps(consumer, frames, messages, links):
    return [consumer.take(messages[frame.stamp], links) for frame in frames
            if frame.stamp in messages]


def test_while_tracked_everyone_believes_us(run, frames):
    messages, links = run(frames)
    rtabmap = RtabMap()
    assert maps(rtabmap, frames, messages, links) == COUNT * [Map.EXTENDED]
    assert len(rtabmap.link_covariances) == COUNT  # none is ignored
    ekf, nav2 = RobotLocalization('odom', 'base_link'), Nav2('base_link')
    for before, frame in zip(frames, frames[1:]):
        ekf.take(messages[frame.stamp])
        T_odom_base = links[frame.stamp]
        np.testing.assert_allclose(ekf.position, T_odom_base[:3, 3], atol=0.002)
        step = T_odom_base[:3, 3] - links[before.stamp][:3, 3]
        twist = messages[frame.stamp].twist.twist.linear
        assert nav2.speed(messages[frame.stamp]) == pytest.approx(
            np.hypot(twist.x, twist.y))
        assert np.linalg.norm([twist.x, twist.y, twist.z]) == pytest.approx(
            30 * np.linalg.norm(step), rel=0.02, abs=1e-3)
    assert ekf.warnings == []
    assert nav2.can_place_scan(frames[3].stamp + 10 ** 7, links)


def test_a_held_pose_is_no_measurement_of_standstill(run, with_loss):
    messages, links = run(with_loss, lost_policy='hold')
    with_tf = maps(RtabMap(), with_loss, messages, links)
    assert [with_tf[i] for i in DARK] == len(DARK) * [Map.WAITS]
    without_tf = maps(RtabMap(uses_tf=False), with_loss, messages, links)
    assert [without_tf[i] for i in DARK] == len(DARK) * [Map.NEW]
    for found in (with_tf, without_tf):  # the first pose after a loss belongs to no old map
        assert found[FOUND] is Map.NEW
        assert found[FOUND + 2:] == (COUNT - FOUND - 2) * [Map.EXTENDED]
    ekf, nav2 = RobotLocalization('odom', 'base_link'), Nav2('base_link')
    for i, frame in enumerate(with_loss):
        pull = ekf.take(messages[frame.stamp])
        if i in DARK:
            assert pull < 1e-6  # no weight
            assert nav2.speed(messages[frame.stamp]) == 0.0
    assert set(ekf.warnings) == {'very large covariance'}
    in_the_dark = with_loss[DARK.start + 2].stamp
    before = {stamp: T for stamp, T in links.items() if stamp < in_the_dark}
    assert not nav2.can_place_scan(in_the_dark, before)  # TF has stopped, it says so itself


def test_a_null_pose_is_a_loss_for_rtabmap(run, with_loss):
    messages, links = run(with_loss, lost_policy='null')
    found = maps(RtabMap(uses_tf=False), with_loss, messages, links)
    assert [found[i] for i in (*DARK, FOUND)] == (len(DARK) + 1) * [Map.NEW]
    assert found[:DARK.start] == DARK.start * [Map.EXTENDED]
    assert found[FOUND + 2:] == (COUNT - FOUND - 2) * [Map.EXTENDED]
    assert [stamp for stamp in links if stamp in {with_loss[i].stamp for i in DARK}] == []
    ekf = RobotLocalization('odom', 'base_link')
    for frame in with_loss:
        ekf.take(messages[frame.stamp])
    assert 'null quaternion taken for identity' in ekf.warnings


def test_silent_there_is_nothing_to_misunderstand(run, with_loss):
    messages, links = run(with_loss, lost_policy='silent')
    dark = {with_loss[i].stamp for i in DARK}
    assert dark.isdisjoint(messages)
    assert dark.isdisjoint(links)
    found = maps(RtabMap(), with_loss, messages, links)
    assert found[DARK.start] is Map.NEW  # the first message after the loss


def test_a_reset_begins_a_new_map(run, frames):
    messages, links = run(frames, reset_before=8)
    found = maps(RtabMap(), frames, messages, links)
    assert found == 8 * [Map.EXTENDED] + [Map.NEW] + (COUNT - 9) * [Map.EXTENDED]


def test_the_link_that_rtabmap_makes_has_the_covariance_of_the_increment_if_asked(run, frames):
    """By the covariance of a velocity its links would be 30 times as uncertain at 30 Hz."""
    messages, links = run(frames, twist_covariance='increment')
    rtabmap, odometry = RtabMap(), Odometry()
    maps(rtabmap, frames, messages, links)
    updates = [odometry.register_frame(frame) for frame in frames]
    for update, covariance in list(zip(updates, rtabmap.link_covariances))[1:]:
        np.testing.assert_allclose(
            np.linalg.eigvalsh(covariance[3:, 3:]),
            np.linalg.eigvalsh(update.increment.pose.covariance[3:, 3:]), rtol=1e-5)


def test_nav2_subscribes_reliably_and_is_heard(rig, start_node, frames):
    heard = []
    rig.node.create_subscription(OdometryMessage, 'odom', heard.append, QoSProfile(
        depth=10, reliability=ReliabilityPolicy.RELIABLE))
    start_node()
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:5]:
        rig.send(frame)
    rig.wait_until(lambda: len(heard) == 5, 'the odometry by a reliable subscription')
