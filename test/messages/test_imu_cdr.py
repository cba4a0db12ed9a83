# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fields of a serialized message of an IMU, against an independent reader and writer of CDR."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from aick_ros.messages.imu_cdr import read_imu

STORE = get_typestore(Stores.ROS2_HUMBLE)


def message(frame_id='imu', seconds=5):
    """Return a message whose numbers all differ."""
    types = STORE.types
    numbers = iter(np.arange(1, 38) / 8)

    def some(count):
        return [float(next(numbers)) for _ in range(count)]
    vector = types['geometry_msgs/msg/Vector3']
    orientation = types['geometry_msgs/msg/Quaternion'](*some(4)), np.array(some(9))
    return types['sensor_msgs/msg/Imu'](
        types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](seconds, 7), frame_id),
        *orientation, vector(*some(3)), np.array(some(9)), vector(*some(3)), np.array(some(9)))


def serialized(message, little_endian=True):
    return bytes(STORE.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))


@pytest.mark.parametrize('little_endian', [True, False])
@pytest.mark.parametrize('frame_id', ['', 'a', 'imu', 'imu_link', 'imu_link_', '\u00fc', 99 * 'x'])
@pytest.mark.parametrize('seconds', [5, -5, 2 ** 31 - 1])
def test_the_fields_are_those_that_were_written(frame_id, little_endian, seconds):
    sent = message(frame_id, seconds)
    read = read_imu(serialized(sent, little_endian))
    assert (read.stamp, read.frame_id) == (seconds * 10 ** 9 + 7, frame_id)
    for values, vector, covariance in (
            (read.rate, sent.angular_velocity, sent.angular_velocity_covariance),
            (read.acceleration, sent.linear_acceleration, sent.linear_acceleration_covariance)):
        assert values == (vector.x, vector.y, vector.z, covariance[0])


def test_other_layouts_and_damaged_messages_are_not_read():
    whole = serialized(message())
    assert read_imu(whole) and read_imu(whole + b'1234')  # some middleware pads
    assert not [size for size in range(len(whole)) if read_imu(whole[:size])]
    assert read_imu(b'\0\7' + whole[2:]) is None  # version 2 of CDR
    assert read_imu(whole[:12] + b'\xff\xff\xff\xff' + whole[16:]) is None
    assert read_imu(whole[:16] + b'\xff\xfe' + whole[18:]).frame_id == '\ufffd\ufffdu'
