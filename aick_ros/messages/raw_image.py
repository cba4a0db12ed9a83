# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The images in sensor_msgs/Image messages.

Only the fields of a message are used, so messages of rclpy and of rosbags both work. Depth follows
REP 118: 16UC1 in millimetres with 0 for no depth, 32FC1 in metres with NaN for no depth.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import cv2
import numpy as np

from aick_ros.borders.encoded_image import ByteData
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.depth_units import MILLIMETRES, to_metres, to_units, valid_metres
from aick_ros.messages.png_jpeg import to_8_bit


class ImageMessage(Protocol):
    """The fields of a sensor_msgs/Image that are used; ``step`` is the length of a row [byte]."""

    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: ByteData


@dataclass(frozen=True, eq=False)
class ImageFields:
    """An image as the fields of a sensor_msgs/Image; ``data`` is flat, N uint8."""

    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: np.ndarray


class _Layout(NamedTuple):
    """Storage of a pixel, and its conversion to grey or red, green, blue; None: unchanged."""

    channels: int
    dtype: type = np.uint8
    convert: Callable[[np.ndarray], np.ndarray] | None = None


def _converted(channels: int, code: int, dtype: type = np.uint8) -> _Layout:
    def convert(pixels: np.ndarray) -> np.ndarray:
        return cv2.cvtColor(pixels if dtype == np.uint8 else to_8_bit(pixels), code)
    return _Layout(channels, dtype, convert)


_BAYER = {'rggb': cv2.COLOR_BayerRGGB2RGB, 'bggr': cv2.COLOR_BayerBGGR2RGB,
          'gbrg': cv2.COLOR_BayerGBRG2RGB, 'grbg': cv2.COLOR_BayerGRBG2RGB}
_COLOUR = {
    'rgb8': _Layout(3),
    'mono8': _Layout(1),
    '8UC1': _Layout(1),
    'bgr8': _converted(3, cv2.COLOR_BGR2RGB),
    '8UC3': _converted(3, cv2.COLOR_BGR2RGB),
    'rgba8': _converted(4, cv2.COLOR_RGBA2RGB),
    'bgra8': _converted(4, cv2.COLOR_BGRA2RGB),
    '8UC4': _converted(4, cv2.COLOR_BGRA2RGB),
    'mono16': _Layout(1, np.uint16, to_8_bit),
    'rgb16': _Layout(3, np.uint16, to_8_bit),
    'bgr16': _converted(3, cv2.COLOR_BGR2RGB, np.uint16),
    'yuv422': _converted(2, cv2.COLOR_YUV2RGB_UYVY),
    'uyvy': _converted(2, cv2.COLOR_YUV2RGB_UYVY),
    'yuv422_yuy2': _converted(2, cv2.COLOR_YUV2RGB_YUY2),
    'yuyv': _converted(2, cv2.COLOR_YUV2RGB_YUY2),
    **{f'bayer_{pattern}{8 * dtype().itemsize}': _converted(1, code, dtype)
       for pattern, code in _BAYER.items() for dtype in (np.uint8, np.uint16)},
}
_DEPTH = {'16UC1': np.uint16, 'mono16': np.uint16, '32FC1': np.float32}

COLOUR_ENCODINGS = tuple(_COLOUR)
"""Encodings that :func:`decode_colour` decodes."""

DEPTH_ENCODINGS = tuple(_DEPTH)
"""Encodings that :func:`decode_depth` decodes."""


def decode_colour(message: ImageMessage, bits: BitDepth | None = None) -> np.ndarray:
    """
    Return the colour image in a message.

    :param bits: those of the camera, where its images have 16; None: it uses all of them.
    :returns: HxWx3 (red, green, blue) or HxW uint8; a view of the message's data for rgb8
        and mono8, which changes with it.
    :raises InputError: where the fields contradict each other or the encoding is not of colour.
    """
    layout = _COLOUR.get(message.encoding)
    if layout is None:
        raise _wrong_encoding('colour', message.encoding, _COLOUR, _DEPTH)
    if layout.channels == 2 and message.width % 2:
        raise InputError(f'the image is {message.width} pixels wide, and {message.encoding} '
                         'stores them in pairs: check the driver')
    pixels = _pixels(message, layout)
    if bits is not None and layout.dtype == np.uint16:
        pixels = bits.full_range(pixels)
    return pixels if layout.convert is None else layout.convert(pixels)


def decode_depth(message: ImageMessage) -> np.ndarray:
    """
    Return the depth image in a message.

    :returns: HxW float32 [m]; NaN where there is no depth.
    :raises InputError: where the fields contradict each other or the encoding is not of depth.
    """
    dtype = _DEPTH.get(message.encoding)
    if dtype is None:
        raise _wrong_encoding('depth', message.encoding, _DEPTH, _COLOUR)
    pixels = _pixels(message, _Layout(1, dtype))
    return to_metres(pixels, MILLIMETRES) if dtype == np.uint16 else valid_metres(pixels)


def encode_colour(image: np.ndarray) -> ImageFields:
    """Return the fields of a message with a colour image, HxWx3 (rgb8) or HxW (mono8) uint8."""
    return _fields(image, 'mono8' if image.ndim == 2 else 'rgb8')


def encode_depth(depth: np.ndarray, encoding: str = '32FC1') -> ImageFields:
    """
    Return the fields of a message with a depth image.

    :param depth: HxW float32 [m], NaN where there is no depth.
    :param encoding: ``32FC1`` keeps depth bit for bit, ``16UC1`` rounds to millimetres.
    :raises InputError: for another encoding.
    """
    if encoding == '32FC1':
        return _fields(depth, encoding)
    if encoding == '16UC1':
        return _fields(to_units(depth, MILLIMETRES), encoding)
    raise InputError(f'depth cannot be encoded as {quoted(encoding)}: use 32FC1 or 16UC1')


def _pixels(message: ImageMessage, layout: _Layout) -> np.ndarray:
    """Return a view of a message's data, HxW or HxWxC, after checking that it holds an image."""
    height, width, step = message.height, message.width, message.step
    dtype = np.dtype(layout.dtype).newbyteorder('>' if message.is_bigendian else '<')
    if height <= 0 or width <= 0:
        raise InputError(f'the image is {width} x {height} pixels: check the driver')
    row = width * layout.channels * dtype.itemsize
    if step < row:
        raise InputError(f'rows of the image have step {step}, and {width} pixels of '
                         f'{message.encoding} need {row} bytes: check the driver')
    if len(message.data) < height * step:
        raise InputError(f'the image has {len(message.data)} bytes, and {height} rows of {step} '
                         f'need {height * step}: check the driver or record it again')
    rows = np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)
    pixels = rows[:, :row].view(dtype)
    return pixels if layout.channels == 1 else pixels.reshape(height, width, layout.channels)


def _fields(image: np.ndarray, encoding: str) -> ImageFields:
    image = np.ascontiguousarray(image, image.dtype.newbyteorder('<'))
    height, width = image.shape[:2]
    return ImageFields(height, width, encoding, 0, image.strides[0], image.reshape(-1).view('u1'))


def _wrong_encoding(kind: str, encoding: str, known: Collection[str],
                    others: Collection[str]) -> InputError:
    if encoding in others:
        other = 'depth' if kind == 'colour' else 'colour'
        return InputError(f'the {kind} image has encoding {encoding}, which is {other}: use the '
                          f'topic of the {kind} image')
    return InputError(f'the {kind} image has unknown encoding {quoted(encoding)}: known are '
                      + ', '.join(known))
