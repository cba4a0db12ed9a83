# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data to colour and depth images."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.borders.encoded_image import ByteData, decode
from aick_ros.errors import InputError
from aick_ros.messages.bit_depth import BitDepth


def decode_colour(data: ByteData, bits: BitDepth | None = None) -> np.ndarray:
    """
    Return the colour image in PNG or JPEG data.

    :param bits: those of the camera, where its images have 16; None: it uses all of them.
    :returns: HxWx3 (red, green, blue) or HxW uint8; 16 bits per channel are scaled to 8.
    :raises InputError: where the data cannot be decoded.
    """
    image = decode(data)
    if image.dtype == np.uint16:
        image = to_8_bit(image if bits is None else bits.full_range(image))
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
    return require_units(decode(data))


def require_units(image: np.ndarray) -> np.ndarray:
    """
    Return an image that is one of depth.

    :param image: as :func:`decode` returns it.
    :returns: HxW uint16.
    :raises InputError: where it is not one channel of 16 bits.
    """
    if image.dtype != np.uint16 or image.ndim != 2:
        channels = 1 if image.ndim == 2 else image.shape[2]
        plural = '' if channels == 1 else 's'
        raise InputError(f'it has {channels} channel{plural} of {image.dtype}, a depth image has '
                         'one of uint16: use the depth image as the camera sends it, not the '
                         'colour image, nor a depth image made to be looked at')
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
