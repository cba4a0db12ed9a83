# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages: exact stamps, valid quaternions, covariances that consumers accept."""

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3

from aick_ros.geometry import se3
from aick_ros.ros import conversions

POSE = se3.exp([0.1, 0.2, 0.3, 1.0, -0.5, 0.25])


@pytest.mark.parametrize('stamp', [0, 1, 999_999_999, 1_000_000_000, 1305031102_175304123])
def test_stamps_survive(stamp):
    assert conversions.to_stamp(conversions.to_time(stamp)) == stamp


def test_poses_survive():
    np.testing.assert_allclose(conversions.from_pose(conversions.pose(POSE)), POSE, atol=1e-12)
    link = conversions.transform_stamped(5, 'odom', 'base_link', POSE)
    assert (link.header.frame_id, link.child_frame_id) == ('odom', 'base_link')
    np.testing.assert_allclose(conversions.from_transform(link.transform), POSE, atol=1e-12)


def test_a_null_quaternion_is_no_pose():
    transform = Transform()
    transform.rotation.w = 0.0
    with pytest.raises(ValueError, match='not a pose'):
        conversions.from_transform(transform)


@pytest.mark.parametrize('covariance', [
    np.zeros((6, 6)), np.full((6, 6), np.nan), np.diag([np.inf] * 6), np.diag([-1.0] * 6),
    np.diag([1e-30] * 6), np.eye(6),
    np.eye(6) * 0.01 + np.where(np.arange(36).reshape(6, 6) == 1, np.inf, 0)])
def test_no_covariance_that_a_consumer_takes_for_unset(covariance):
    sent = conversions.pose_with_covariance(0, 'odom', POSE, covariance).pose.covariance
    diagonal = np.reshape(sent, (6, 6)).diagonal()
    assert np.isfinite(sent).all()
    assert (diagonal > 0).all()
    assert diagonal[0] != 1.0
    assert np.linalg.eigvalsh(np.reshape(sent, (6, 6))).min() > 0


def test_covariance_is_row_major():
    covariance = np.arange(36.0).reshape(6, 6) + np.eye(6)
    sent = conversions.pose_with_covariance(0, 'odom', POSE, covariance).pose.covariance
    assert sent[1] == 1.0
    assert sent[6] == 6.0
    assert sent[7] == 8.0


def test_the_sign_and_the_order_of_a_quaternion_are_those_of_ros():
    """A quarter turn about z, x to y; about x, y to z."""
    half = 0.5 ** 0.5
    for axis, expected in ((2, (0.0, 0.0, half, half)), (0, (half, 0.0, 0.0, half))):
        turn = se3.exp(np.pi / 2 * np.eye(6)[3 + axis])
        q = conversions.quaternion(turn[:3, :3])
        np.testing.assert_allclose((q.x, q.y, q.z, q.w), expected, atol=1e-12)
    np.testing.assert_allclose(conversions.from_pose(Pose(
        position=Point(x=1.0, y=2.0, z=3.0), orientation=Quaternion(z=half, w=half)))
        @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)


def test_a_place_keeps_the_order_of_its_axes():
    T = se3.exp([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])
    for place in (conversions.pose(T).position,
                  conversions.transform_stamped(0, '', '', T).transform.translation):
        assert (place.x, place.y, place.z) == (1.0, 2.0, 3.0)


def test_a_header_has_the_stamp_and_the_frame():
    made = conversions.header(1305031102_175304123, 'odom')
    assert (made.stamp.sec, made.stamp.nanosec, made.frame_id) == (1305031102, 175304123, 'odom')
    for message in (conversions.transform_stamped(5_000_000_007, 'odom', 'base', POSE),
                    conversions.pose_with_covariance(5_000_000_007, 'odom', POSE, np.eye(6)),
                    conversions.null_pose(5_000_000_007, 'odom')):
        assert message.header == conversions.header(5_000_000_007, 'odom')


def test_the_pose_of_a_lost_camera_is_null():
    lost = conversions.null_pose(1, 'odom').pose
    assert lost.pose == Pose(orientation=Quaternion(w=0.0))
    np.testing.assert_array_equal(np.reshape(lost.covariance, (6, 6)), 9999.0 * np.eye(6))


def test_an_odometry_is_a_pose_and_a_velocity_each_with_its_covariance():
    """RTAB-Map reads it from the message alone, so no field may be left out or exchanged."""
    first = np.diag([1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3])
    second = 0.1 * first + 1e-6 * np.arange(36.0).reshape(6, 6)
    pose = conversions.pose_with_covariance(5, 'odom', POSE, first)
    message = conversions.odometry(pose, 'base', np.array([1, 2, 3, 4, 5, 6], np.float32), second)
    assert (message.header, message.child_frame_id) == (conversions.header(5, 'odom'), 'base')
    assert message.pose == pose.pose
    twist = message.twist.twist
    assert (twist.linear, twist.angular) == (Vector3(x=1.0, y=2.0, z=3.0),
                                             Vector3(x=4.0, y=5.0, z=6.0))
    np.testing.assert_array_equal(np.reshape(message.pose.covariance, (6, 6)), first)
    np.testing.assert_array_equal(np.reshape(message.twist.covariance, (6, 6)), second)


def sent(covariance):
    message = conversions.pose_with_covariance(0, 'odom', POSE, covariance)
    return np.reshape(message.pose.covariance, (6, 6))


@pytest.mark.parametrize('bad', [np.nan, np.inf])
def test_a_covariance_that_is_not_finite_is_unknown(bad):
    covariance = np.eye(6)
    covariance[3, 4] = bad
    np.testing.assert_array_equal(sent(covariance), 9999.0 * np.eye(6))


def test_what_consumers_take_for_unset_is_changed_by_next_to_nothing_and_nothing_else_is():
    covariance = 0.25 * np.ones((6, 6)) + np.diag([0.75, 1.0, 2.0, 3.0, -0.25, 1e-12 - 0.25])
    found, before = sent(covariance), covariance.copy()
    assert 1.0 < found[0, 0] < 1.0 + 1e-15
    assert 0.0 < found[4, 4] < 1e-8 and 0.0 < found[5, 5] < 1e-8
    np.testing.assert_array_equal(found - np.diag(np.diag(found)),
                                  0.25 * (np.ones((6, 6)) - np.eye(6)))
    np.testing.assert_array_equal(np.diag(found)[1:4], np.diag(covariance)[1:4])
    np.testing.assert_array_equal(covariance, before)  # that of the caller


def test_a_variance_of_one_elsewhere_is_a_variance_of_one():
    np.testing.assert_array_equal(np.diag(sent(np.diag([2.0, 1, 1, 1, 1, 1])))[1:], np.ones(5))


def test_who_changes_a_message_changes_no_later_one():
    for make in (lambda: conversions.null_pose(1, 'odom'),
                 lambda: conversions.pose_with_covariance(1, 'odom', POSE, conversions.UNKNOWN)):
        make().pose.covariance[0] = 5.0
        assert make().pose.covariance[0] == 9999.0
        assert conversions.UNKNOWN[0, 0] == 9999.0
    broken = np.full((6, 6), np.nan)
    sent(broken)[0, 0] = 5.0
    assert sent(broken)[0, 0] == conversions.UNKNOWN[0, 0] == 9999.0


@pytest.mark.parametrize('far', [1e12, np.nan])
def test_a_place_that_is_none_is_rejected(far):
    with pytest.raises(ValueError):
        conversions.from_pose(Pose(position=Point(z=far)))
    with pytest.raises(ValueError):
        conversions.from_transform(Transform(translation=Vector3(y=far)))
