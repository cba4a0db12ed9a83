# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data to colour and depth images, and depth to and from whole units."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from aick_ros.errors import InputError

_MARKS = {
    'PNG': (b'\x89PNG\r\n\x1a\n', b'IEND\xaeB`\x82'),
    'JPEG': (b'\xff\xd8\xff', b'\xff\xd9'),
}
"""Name of a format -> what its data begins with, and what ends it."""


def decode(data: Any) -> np.ndarray:
    """
    Return the image in PNG or JPEG data as it is stored, colours in the order blue, green, red.

    :param data: bytes, or whatever has their buffer.
    :returns: HxW or HxWxC, uint8 or uint16.
    :raises InputError: where the data is truncated, damaged or something else.
    """
    content = bytes(data)
    if not content:
        raise InputError('it is empty: copy or record it again')
    for name, (begin, end) in _MARKS.items():
        if content.startswith(begin):
            break
    else:
        raise InputError(f'its {len(content)} bytes are neither PNG nor JPEG data: store the '
                         'image in one of these formats')
    # some versions of OpenCV make up the rest of a truncated image instead of refusing it
    image = None
    if end in content:
        try:
            image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            pass
    if image is None:
        state = 'damaged' if end in content else 'truncated'
        raise InputError(f'its {len(content)} bytes of {name} data are {state}: copy or record it '
                         'again')
    return image


def decode_colour(data: Any) -> np.ndarray:
    """
    Return the colour image in PNG or JPEG data.

    :returns: HxWx3 (red, green, blue) or HxW uint8; 16 bits a channel are scaled to 8.
    :raises InputError: where the data cannot be decoded.
    """
    image = decode(data)
    if image.dtype == np.uint16:
        image = to_8_bit(image)
    if image.ndim == 2:
        return image
    code = {3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGB}[image.shape[2]]
    return cv2.cvtColor(image, code)


def decode_units(data: Any) -> np.ndarray:
    """
    Return the depth image in PNG data, in whatever unit it is stored.

    :returns: HxW uint16.
    :raises InputError: where the data cannot be decoded or is no image of 16-bit numbers.
    """
    image = decode(data)
    if image.dtype != np.uint16 or image.ndim != 2:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise InputError(f'it has {channels} channels of {image.dtype}, a depth image has one of '
                         'uint16: take the depth instead of the colour image')
    return image


def to_8_bit(image: np.ndarray) -> np.ndarray:
    """Return a uint16 image scaled to uint8, full range to full range."""
    # OpenCV knows neither foreign byte orders nor rows at odd addresses
    image = np.ascontiguousarray(image, np.uint16)
    return cv2.convertScaleAbs(image, alpha=255.0 / 65535.0)


def to_metres(units: np.ndarray, units_per_metre: float) -> np.ndarray:
    """
    Return depth in metres of depth in whole units.

    :param units: HxW uint16, 0 where there is none.
    :returns: HxW float32 [m], NaN where there is none.
    """
    depth = units.astype(np.float32)
    depth[depth == 0.0] = np.nan
    depth /= np.float32(units_per_metre)
    return depth


def valid_metres(depth: np.ndarray) -> np.ndarray:
    """
    Return depth of whatever byte order as a native copy, with NaN for 0, negative and infinite.

    :param depth: HxW float32 [m].
    """
    depth = depth.astype(np.float32)
    np.copyto(depth, np.nan, where=~((depth > 0.0) & (depth < np.inf)))
    return depth


def to_units(depth: np.ndarray, units_per_metre: float) -> np.ndarray:
    """
    Return depth rounded to whole units, the inverse of :func:`to_metres`.

    :param depth: HxW float32 [m].
    :returns: HxW uint16; 0 where there is no depth or it is too far for 16 bits.
    """
    units = np.rint(depth * np.float32(units_per_metre))
    with np.errstate(invalid='ignore'):
        return np.where((units > 0) & (units < 65536), units, 0).astype(np.uint16)
