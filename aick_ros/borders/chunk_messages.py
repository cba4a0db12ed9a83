# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The messages in a chunk of an MCAP file.

rosbags makes several objects of each, those of topics that nothing reads included, so that a
chunk of small messages takes many times its size and minutes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from operator import attrgetter
from typing import Any, BinaryIO, Protocol

from aick_ros.borders.limits import MAX_CHUNK_MESSAGES
from aick_ros.errors import InputError

_HEAD = struct.Struct('<QQQI')  # of a chunk: stamps, unpacked bytes, their checksum
_RECORD = struct.Struct('<BQ')  # opcode, bytes
_MESSAGE, _MESSAGE_HEAD = 5, struct.Struct('<HIQQ')  # channel, number, log time, stamp


class ChunkPlace(Protocol):
    """Place of a chunk, by the index of its file."""

    message_start_time: int
    chunk_start_offset: int
    compression: str
    compressed_size: int
    uncompressed_size: int


@cache
def limit_messages() -> None:
    """Let rosbags, which has no limit to them, read the messages of a chunk by this module."""
    mcap = import_module('rosbags.rosbag2.storage_mcap')

    def messages(chunk: ChunkPlace, channels: Mapping[int, Any], start: int, stop: int,
                 file: BinaryIO) -> Iterator[Any]:
        """Yield what rosbags expects: the time at which the chunk is required, then messages."""
        yield mcap.Msg(chunk.message_start_time, 0, None, None)
        found = [mcap.Msg(time, chunk.chunk_start_offset, channels[channel], content)
                 for channel, time, content in read_messages(
                     _unpacked(mcap, chunk, file), channels)
                 if start <= time < stop]
        yield from sorted(found, key=attrgetter('timestamp'))

    setattr(mcap, 'msgsrc', messages)


def read_messages(chunk: bytes, channels: Mapping[int, Any]) -> Iterator[tuple[int, int, bytes]]:
    """
    Yield channel, log time [ns] and content of the messages in an unpacked chunk.

    :param channels: those that are read, as keys.
    :raises InputError: where they have too many messages, or a record goes beyond the chunk.
    """
    place, count, size = 0, 0, len(chunk)
    while place < size:
        if place + _RECORD.size > size:
            raise InputError('a record in a chunk is truncated')
        opcode, length = _RECORD.unpack_from(chunk, place)
        start = place + _RECORD.size
        place = start + length
        if place > size or opcode == _MESSAGE and length < _MESSAGE_HEAD.size:
            raise InputError('a record in a chunk is truncated')
        if opcode != _MESSAGE:
            continue
        channel, _, time, _ = _MESSAGE_HEAD.unpack_from(chunk, start)
        if channel in channels:
            count += 1
            if count > MAX_CHUNK_MESSAGES:
                raise InputError(f'a chunk has more than {MAX_CHUNK_MESSAGES} messages of the '
                                 'topics that are read')
            yield channel, time, chunk[start + _MESSAGE_HEAD.size:place]


def _unpacked(mcap: Any, chunk: ChunkPlace, file: BinaryIO) -> bytes:
    """Return the content of a chunk; InputError where it is not what its head declares."""
    file.seek(chunk.chunk_start_offset + _RECORD.size)
    head = file.read(_HEAD.size)
    # after it the name of the compression and the packed size, with the length of the first
    file.seek(4 + len(chunk.compression.encode()) + 8, 1)
    packed = file.read(chunk.compressed_size)
    if len(head) < _HEAD.size or len(packed) < chunk.compressed_size:
        raise InputError('a chunk is truncated')
    if chunk.compression not in mcap.DECOMPRESSORS:
        raise InputError(f'its compression {chunk.compression!r} is not known')
    content: bytes = mcap.DECOMPRESSORS[chunk.compression](packed, chunk.uncompressed_size)
    if len(content) != chunk.uncompressed_size:
        raise InputError(f'a chunk of {len(content)} bytes is declared as '
                         f'{chunk.uncompressed_size}')
    *_, checksum = _HEAD.unpack(head)
    if checksum and zlib.crc32(content) != checksum:
        raise InputError('a chunk has another checksum')
    return content
