# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The index of a ROS 1 bag, of limited size.

It may name any chunk, and any part of itself, again and again, so that a few bytes take any memory
and time.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from aick_ros.borders.limits import (
    MAX_INDEXED_MESSAGES, MAX_MESSAGE_BYTES, MAX_UNPACKING, MEAN_MESSAGE_BYTES)
from aick_ros.errors import InputError

_HEAD, _ENTRY = 55, 12  # bytes, by definition: a record before its entries, and one of these
_LENGTH = struct.Struct('<I')  # of the entries, at the end of the head
_LEAST_UNPACKED = 4 * MAX_MESSAGE_BYTES  # chosen: small bags may have been merged of several


@cache
def limit_index() -> None:
    """Let rosbags, which has no limit to it, read the index of a ROS 1 bag within the limits."""
    reader = import_module('rosbags.rosbag1.reader').Reader
    setattr(reader, 'read_index_data', _limited(reader.read_index_data))


def _limited(read: Callable[..., None]) -> Callable[..., None]:
    total = '_index_bytes'  # name of an attribute of a reader

    def read_limited(reader: Any, place: int, indexes: Any) -> None:
        start, size = reader.bio.tell(), reader.path.stat().st_size
        head = reader.bio.read(_HEAD)
        reader.bio.seek(start)
        if len(head) == _HEAD:
            length = _HEAD + _LENGTH.unpack_from(head, _HEAD - _LENGTH.size)[0]
            setattr(reader, total, getattr(reader, total, 0) + length)
        read_before = getattr(reader, total, 0)
        if read_before > size:  # each of its bytes is read once
            raise InputError('its index names chunks again and again')
        most = max(MAX_INDEXED_MESSAGES, size // MEAN_MESSAGE_BYTES)
        if read_before // _ENTRY > most:
            raise InputError(f'its index has more than {most} messages')
        read(reader, place, indexes)
    return read_limited


def limit_chunks(reader: Any, path: Path) -> None:
    """
    Let a reader of a ROS 1 bag, which keeps one chunk, unpack them so often within a limit only.

    :param reader: of rosbags, which has been opened.
    """
    left = max(_LEAST_UNPACKED, MAX_UNPACKING * path.stat().st_size)

    def limited(unpack: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
        def unpack_limited(packed: bytes) -> bytes:
            nonlocal left
            content = unpack(packed)
            left -= len(content)
            if left < 0:
                raise InputError('its messages alternate between chunks, so that it unpacks to '
                                 f'more than {MAX_UNPACKING} times its size')
            return content
        return unpack_limited
    reader.chunks = {place: chunk._replace(decompressor=limited(chunk.decompressor))
                     for place, chunk in reader.chunks.items()}
