# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data, unpacked with care."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, TypeAlias

import cv2
import numpy as np

from aick_ros.borders.codec_messages import codecs_silenced
from aick_ros.borders.limits import MAX_PIXELS, MAX_SCANS, MAX_SIDE
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

_JPEG_SCAN = b'\xff\xda'
"""Marker of a scan, which no data of scans has in it."""

_NOTES = (b'tEXt', b'zTXt', b'iTXt', b'iCCP')
"""Chunks of a PNG that OpenCV makes nothing of, though libpng unpacks each."""

_JPEG_FRAMES = set(range(0xc0, 0xd0)) - {0xc4, 0xc8, 0xcc}
"""Markers of a frame header (ITU-T T.81, Table B.1)."""


def format_of(content: bytes) -> str:
    """Return the name of the format that data begins like, PNG or JPEG; '' for any other."""
    return next((name for name, (first, _) in _SIGNATURES.items() if content.startswith(first)),
                '')


def decode(data: ByteData) -> np.ndarray:
    """
    Return the image in PNG or JPEG data as it is stored.

    :returns: HxW or HxWxC (blue, green, red, alpha), uint8 or uint16.
    :raises InputError: where the data is truncated, damaged or of another format.
    """
    content = bytes(data)
    if not content:
        raise InputError('it is empty: copy or record it again')
    name = format_of(content)
    if not name:
        raise InputError(f'its {len(content)} bytes are neither PNG nor JPEG data: store the '
                         'image in one of these formats')
    _, last = _SIGNATURES[name]
    # some versions of OpenCV invent the rest of a truncated image instead of rejecting it
    image = None
    size = (_png_size if name == 'PNG' else _jpeg_size)(content)
    if size is not None and not _is_acceptable(*size):
        raise InputError(f'its {name} data is declared as {size[0]} x {size[1]} pixels: at most '
                         f'{MAX_SIDE} on a side and {MAX_PIXELS} in all are supported')
    if last in content and size is not None:
        if name == 'PNG':
            content = _without_notes(content)
        elif content.count(_JPEG_SCAN) > MAX_SCANS:
            raise InputError(f'its JPEG data has more than {MAX_SCANS} scans: store the image '
                             'again')
        try:
            with codecs_silenced():
                image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            pass
    if image is None:
        state = 'damaged' if last in content else 'truncated'
        raise InputError(f'its {len(content)} bytes of {name} data are {state}: copy or record it '
                         'again')
    return image


def _is_acceptable(width: int, height: int) -> bool:
    return max(width, height) <= MAX_SIDE and width * height <= MAX_PIXELS


def _png_size(content: bytes) -> tuple[int, int] | None:
    """Return columns and rows; None where a chunk is damaged, of which libpng would print."""
    size = None
    for kind, start, end in _png_chunks(content):
        if size is None:
            if kind != b'IHDR' or end - start != 25:
                return None
            size = struct.unpack_from('>II', content, start + 8)
            if not _is_acceptable(*size):
                return size
        is_critical = not kind[0] & 0x20
        if is_critical and zlib.crc32(memoryview(content)[start + 4:end - 4]) != int.from_bytes(
                content[end - 4:end], 'big'):
            return None
        if kind == b'IEND':
            return size
    return None


def _without_notes(content: bytes) -> bytes:
    """Return whole PNG data without texts and profiles, which may unpack to any size."""
    kept = [content[:8]]
    for kind, start, end in _png_chunks(content):
        if kind not in _NOTES:
            kept.append(content[start:end])
        if kind == b'IEND':
            break
    return b''.join(kept)


def _png_chunks(content: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Yield the kind of each chunk of PNG data that is whole, and where it begins and ends."""
    start = 8
    while start + 12 <= len(content):
        length, kind = struct.unpack_from('>I4s', content, start)
        end = start + 12 + length
        if end > len(content):
            return
        yield kind, start, end
        start = end


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    """Return columns and rows as the frame header has them; None where there is none."""
    start = 2
    while start + 9 <= len(content):
        if content[start] != 0xff:
            return None
        marker = content[start + 1]
        if marker == 0xff:  # padding
            start += 1
        elif marker in _JPEG_FRAMES:
            height, width = struct.unpack_from('>HH', content, start + 5)
            return width, height
        elif marker == 0x01 or 0xd0 <= marker <= 0xd8:  # markers without a segment
            start += 2
        else:
            start += 2 + int.from_bytes(content[start + 2:start + 4], 'big')
    return None
