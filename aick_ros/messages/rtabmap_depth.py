# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Depth images in the compression of RTAB-Map, as its rgbd_image and its database have them.

Images of 16 bits, in millimetres, are a PNG, or RVL data after the letters DEPTHRVL and the
numbers of columns and rows. Images of floating-point numbers, in metres, are a PNG of four
channels: the bytes of a pixel (blue, green, red, alpha) are those of its number.
"""

from __future__ import annotations

import struct

import numpy as np

from aick_ros.borders.encoded_image import decode
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.messages import png_jpeg
from aick_ros.messages.depth_units import MILLIMETRES, to_metres, valid_metres
from aick_ros.messages.rvl import decode_rvl

_RVL = b'DEPTHRVL'
_SIZE = struct.Struct('<2I')  # columns and rows
_START = len(_RVL) + _SIZE.size


def is_of_rtabmap(format_: str) -> bool:
    """Return whether a message names this compression; image_transport adds an encoding."""
    return format_.strip().lstrip('.').partition(':')[0] in ('png', 'rvl')


def decode_depth(format_: str, content: bytes) -> np.ndarray:
    """
    Return the depth image in data of this compression.

    :param format_: as the message names it.
    :returns: HxW float32 [m]; NaN where there is no depth.
    :raises InputError: where the data is damaged or quantised.
    """
    if ':' in format_:
        raise InputError(f'the depth image has format {quoted(format_)}, which is quantised in a '
                         'way that is not known here: set depth_compression_format of its '
                         'publisher to .png or .rvl')
    if content.startswith(_RVL):
        if len(content) < _START:
            raise InputError(f'its {len(content)} bytes of RVL data are truncated: record it '
                             'again')
        width, height = _SIZE.unpack_from(content, len(_RVL))
        return to_metres(decode_rvl(content[_START:], width, height), MILLIMETRES)
    image = decode(content)
    if image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 4:
        return valid_metres(np.ascontiguousarray(image).view('<f4')[..., 0])
    return to_metres(png_jpeg.require_units(image), MILLIMETRES)
