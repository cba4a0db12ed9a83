# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A sensor_msgs/Imu as it is sent, read without making the message.

Its layout is that of plain CDR (OMG DDS-XTypes, version 1): four bytes that say so, the header,
and 37 numbers of eight bytes, at a multiple of eight after the first four.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from aick_ros.geometry.stamps import NANOSECONDS

_ORDERS = {b'\x00\x00': '>', b'\x00\x01': '<'}  # of bytes; by definition of plain CDR
_FRAME = 16  # by definition: where the frame is, after its length
_HEADERS = {order: struct.Struct(f'{order}4xiII') for order in '<>'}
# without the orientation and its covariance, and of each other covariance the first number
_VALUES = {order: struct.Struct(f'{order}104x4d64x4d64x') for order in '<>'}


class ImuFields(NamedTuple):
    """
    What is read of a message.

    :param stamp: [ns].
    :param rate: 3, and the first number of its covariance.
    :param acceleration: likewise.
    """

    stamp: int
    frame_id: str
    rate: tuple[float, ...]
    acceleration: tuple[float, ...]


def read_imu(message: bytes) -> ImuFields | None:
    """Return the fields of a serialized message; None where it has another layout."""
    order = _ORDERS.get(message[:2])
    if order is None or len(message) < _FRAME:
        return None
    seconds, nanoseconds, length = _HEADERS[order].unpack_from(message)
    numbers = 4 + (_FRAME - 4 + length + 7) // 8 * 8
    if len(message) < numbers + _VALUES[order].size:
        return None
    values = _VALUES[order].unpack_from(message, numbers)
    frame_id = message[_FRAME:_FRAME + max(length - 1, 0)].decode(errors='replace')
    return ImuFields(seconds * NANOSECONDS + nanoseconds, frame_id, values[:4], values[4:])
