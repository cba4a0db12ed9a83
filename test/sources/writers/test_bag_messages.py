# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of a bag that is written, field by field, of a camera that is the same in nothing."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.raw_image import ImageFields
from aick_ros.sources.writers import bag_messages

STAMP = 1_234_567_890_012_345_678
CAMERA = Camera(64, 48, 50.5, 51.5, 31.0, 23.0, 'plumb_bob', (0.1, -0.2, 0.003, 0.004, 0.05))


def assert_header(message, frame='camera_rgb_optical_frame'):
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1234567890, 12345678)
    assert message.header.frame_id == frame


def test_an_image_has_the_fields_in_their_places():
    data = np.arange(48 * 100, dtype=np.uint8)
    message = bag_messages.image(STAMP, ImageFields(48, 64, 'mono8', True, 100, data))
    assert_header(message)
    assert (message.height, message.width, message.encoding, message.is_bigendian,
            message.step) == (48, 64, 'mono8', True, 100)
    np.testing.assert_array_equal(message.data, data)


def test_a_calibration_has_matrix_distortion_and_projection():
    message = bag_messages.camera_info(STAMP, CAMERA)
    assert_header(message)
    assert (message.height, message.width) == (48, 64)
    assert message.distortion_model == 'plumb_bob'
    np.testing.assert_array_equal(message.d, CAMERA.distortion)
    np.testing.assert_array_equal(message.k, [50.5, 0, 31, 0, 51.5, 23, 0, 0, 1])
    np.testing.assert_array_equal(message.p, [50.5, 0, 31, 0, 0, 51.5, 23, 0, 0, 0, 1, 0])
    np.testing.assert_array_equal(message.r, np.eye(3).ravel())
    region = message.roi
    assert (message.binning_x, message.binning_y, region.width, region.height) == (0, 0, 0, 0)
    assert not region.do_rectify


@pytest.mark.parametrize('missing', [(), ('turn',), ('force',), ('turn', 'force')])
def test_what_an_imu_has_not_measured_is_marked(missing):
    turn, force = np.array([0.1, -0.2, 0.3]), np.array([9.0, -8.0, 7.0])
    measured = [np.full(3, np.nan) if name in missing else value
                for name, value in (('turn', turn), ('force', force))]
    message = bag_messages.imu(STAMP, *measured)
    assert_header(message)
    assert message.orientation_covariance[0] == -1
    for name, value, found, covariance in (
            ('turn', turn, message.angular_velocity, message.angular_velocity_covariance),
            ('force', force, message.linear_acceleration, message.linear_acceleration_covariance)):
        assert covariance[0] == (-1 if name in missing else 0)
        assert not covariance[1:].any() and len(covariance) == 9
        assert [found.x, found.y, found.z] == ([0, 0, 0] if name in missing else value.tolist())


def test_a_pose_is_that_of_the_camera_in_the_world():
    T_world_camera = se3.exp([1.0, -2.0, 3.0, 0.3, 0.5, -0.7])
    message = bag_messages.pose(STAMP, T_world_camera)
    assert_header(message, 'world')
    position, q = message.pose.position, message.pose.orientation
    np.testing.assert_allclose(
        se3.from_quaternion((q.x, q.y, q.z, q.w), (position.x, position.y, position.z)),
        T_world_camera, atol=1e-12)
