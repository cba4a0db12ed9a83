# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data to colour and depth images."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import cv2
import numpy as np

from aick_ros.errors import InputError

if TYPE_CHECKING:
    from array import array  # not generic at run time

ByteData: TypeAlias = 'bytes | bytearray | memoryview | array[int] | np.ndarray'
"""Data of messages and files; rclpy has arrays, rosbags uint8 ndarrays."""

_SIGNATURES = {
    'PNG': (b'\x89PNG\r\n\x1a\n', b'IEND\xaeB`\x82'),
    'JPEG': (b'\xff\xd8\xff', b'\xff\xd9'),
}
"""Name of a format -> the first bytes of its data, and those that mark the end of the image."""


def decode(data: ByteData) -> np.ndarray:
    """
    Return the image in PNG or JPEG data as it is stored.

    :returns: HxW or HxWxC (blue, green, red, alpha), uint8 or uint16.
    :raises InputError: where the data is truncated, damaged or of another format.
    """
    content = bytes(data)
    if not content:
        raise InputError('it is empty: copy or record it again')
    for name, (first, last) in _SIGNATURES.items():
        if content.startswith(first):
            break
    else:
        raise InputError(f'its {len(content)} bytes are neither PNG nor JPEG data: store the '
                         'image in one of these formats')
    # some versions of OpenCV invent the rest of a truncated image instead of rejecting it
    image = None
    if last in content:
        try:
            image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            pass
    if image is None:
        state = 'damaged' if last in content else 'truncated'
        raise InputError(f'its {len(content)} bytes of {name} data are {state}: copy or record it '
                         'again')
    return image


def decode_colour(data: ByteData) -> np.ndarray:
    """
    Return the colour image in PNG or JPEG data.

    :returns: HxWx3 (red, green, blue) or HxW uint8; 16 bits per channel are scaled to 8.
    :raises InputError: where the data cannot be decoded.
    """
    image = decode(data)
    if image.dtype == np.uint16:
        image = to_8_bit(image)
    if image.ndim == 2:
        return image
    code = {3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[image.shape[2]]
    return cv2.cvtColor(image, code)


def decode_units(data: ByteData) -> np.ndarray:
    """
    Return the depth image in PNG data, in the unit in which it is stored.

    :returns: HxW uint16.
    :raises InputError: where the data cannot be decoded or is not one channel of 16 bits.
    """
    image = decode(data)
    if image.dtype != np.uint16 or image.ndim != 2:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise InputError(f'it has {channels} channels of {image.dtype}, a depth image has one of '
                         'uint16: use the depth image instead of the colour image')
    return image


def to_8_bit(image: np.ndarray) -> np.ndarray:
    """
    Return an image of 16 bits per channel scaled to 8, full range to full range.

    :param image: HxW or HxWxC uint16, of either byte order and any strides.
    :returns: uint8, of the same shape.
    """
    # OpenCV supports neither foreign byte orders nor rows at odd addresses
    image = np.ascontiguousarray(image, np.uint16)
    return cv2.convertScaleAbs(image, alpha=255.0 / 65535.0)
