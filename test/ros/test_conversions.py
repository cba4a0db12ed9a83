# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages: exact stamps, valid quaternions, covariances that consumers accept."""

import numpy as np
import pytest
from geometry_msgs.msg import Transform

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
