# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The images in sensor_msgs/CompressedImage messages, of image_transport's plugins or RTAB-Map.

Only the fields of a message are used, so messages of rclpy and of rosbags both work.
"""

from __future__ import annotations

import struct
from typing import Protocol

import cv2
import numpy as np

from aick_ros.borders.encoded_image import ByteData
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.messages import png_jpeg, rtabmap_depth
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.depth_units import MILLIMETRES, to_metres, valid_metres
from aick_ros.messages.rvl import decode_rvl

_HEADER = struct.Struct('<4x2f')  # of compressedDepth: four unused bytes, A and B
_RVL_SIZE = struct.Struct('<2i')  # columns and rows


class CompressedImageMessage(Protocol):
    """The fields of a sensor_msgs/CompressedImage that are used."""

    format: str
    data: ByteData


def decode_colour(message: CompressedImageMessage, bits: BitDepth | None = None) -> np.ndarray:
    """
    Return the colour image in a message of the ``compressed`` transport.

    :param bits: those of the camera, where its images have 16; None: it uses all of them.
    :returns: HxWx3 (red, green, blue) or HxW uint8.
    :raises InputError: where the data is damaged or holds depth.
    """
    encoding, _, compression = message.format.partition(';')
    if 'compressedDepth' in message.format or encoding.strip() in ('16UC1', '32FC1'):
        raise InputError(f'the colour image has format {quoted(message.format)}, which is depth: '
                         'use the topic of the colour camera')
    image = png_jpeg.decode_colour(message.data, bits)
    # image_transport names the channel order it stored; without a name it is that of the encoding
    if encoding.startswith('rgb') and 'compressed' in compression and 'bgr' not in compression:
        return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return image


def decode_depth(message: CompressedImageMessage) -> np.ndarray:
    """
    Return the depth image in a message of the ``compressedDepth`` or ``compressed`` transport.

    That of an rgbd_image may be in the compression of RTAB-Map (``rtabmap_depth.py``).

    ``compressedDepth`` has a header before the PNG or RVL data, with two numbers A and B. For
    32FC1 it stores inverse depth: depth = A / (stored - B), and 0 where there is none.

    :returns: HxW float32 [m]; NaN where there is no depth.
    :raises InputError: where the data is damaged or holds colour.
    """
    content = bytes(message.data)
    if rtabmap_depth.is_of_rtabmap(message.format):
        return rtabmap_depth.decode_depth(message.format, content)
    header, units = _header_and_units(message.format, content)
    if not message.format.strip().startswith('32FC1'):
        return to_metres(units, MILLIMETRES)
    scale, offset = _HEADER.unpack(header) if header else (0.0, 0.0)
    if not (np.isfinite((scale, offset)).all() and scale > 0.0):
        raise InputError(f'the depth image has format {quoted(message.format)} and quantisation '
                         f'A {scale:g}, B {offset:g}: A must be positive; check the publisher')
    with np.errstate(divide='ignore'):
        depth = np.float32(scale) / (units - np.float32(offset))
    depth[units == 0] = np.nan
    return valid_metres(depth)


def _header_and_units(format_: str, content: bytes) -> tuple[bytes, np.ndarray]:
    """Return the header of compressedDepth, empty where there is none, and HxW uint16."""
    if 'rvl' not in format_.lower():
        has_header = len(content) >= _HEADER.size and not content.startswith(b'\x89PNG')
        size = _HEADER.size if has_header else 0
        return content[:size], png_jpeg.decode_units(content[size:])
    start = _HEADER.size + _RVL_SIZE.size
    if len(content) < start:
        raise InputError(f'the depth image has format {quoted(format_)} and {len(content)} '
                         f'bytes, fewer than the {start} of its header: it is truncated; record '
                         'it again')
    width, height = _RVL_SIZE.unpack_from(content, _HEADER.size)
    return content[:_HEADER.size], decode_rvl(content[start:], width, height)
