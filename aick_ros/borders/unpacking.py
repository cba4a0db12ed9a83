# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Unpacking of limited size, for the chunks, messages and files of bags.

A header may declare fewer bytes than the packed data has, so each byte is counted as it comes.
"""

from __future__ import annotations

import bz2
import io
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, BinaryIO, Protocol

from aick_ros.borders.limits import MAX_MESSAGE_BYTES, MAX_PACKED_FRAMES, MAX_UNPACKING
from aick_ros.errors import InputError


class Decompressor(Protocol):
    """The common interface of the decompressors of bz2, lz4 and zstd."""

    @property
    def eof(self) -> bool:
        """The end of the frame has been reached."""

    @property
    def unused_data(self) -> bytes | None:
        """Bytes after the frame."""

    def decompress(self, data: bytes, max_length: int = -1, /) -> bytes:
        """Return unpacked bytes, as many as there are up to a number."""


def unpack(make: Callable[[], Decompressor], data: bytes,
           limit: int = MAX_MESSAGE_BYTES) -> bytes:
    """
    Return packed data unpacked, of one or several frames.

    :param make: makes a decompressor of one frame.
    :param limit: largest size of the result [byte].
    :raises InputError: where it is larger, the data breaks off, or it has too many frames.
    """
    content, frames = b'', 0
    while data:
        frames += 1
        if frames > MAX_PACKED_FRAMES:  # all that is left is copied after each
            raise InputError(f'its packed data has more than {MAX_PACKED_FRAMES} frames')
        decompressor = make()
        content += decompressor.decompress(data, limit + 1 - len(content))
        if len(content) > limit:
            raise InputError(f'it unpacks to more than {limit} bytes')
        if not decompressor.eof:
            raise InputError('its packed data breaks off')
        data = decompressor.unused_data or b''
    return content


class _Unpacked(io.RawIOBase):
    """A packed file as its unpacked content, which may be so many times larger."""

    def __init__(self, file: BinaryIO, content: BinaryIO) -> None:
        self._file, self._content, self._size = file, content, 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        part = self._content.read(len(buffer))
        self._size += len(part)
        # the position is that of what was read ahead, so the limit is a little too generous
        if self._size > max(MAX_MESSAGE_BYTES, MAX_UNPACKING * self._file.tell()):
            raise InputError(f'it unpacks to more than {MAX_UNPACKING} times its size')
        buffer[:len(part)] = part
        return len(part)


@cache
def limit_unpacking() -> None:
    """Let rosbags, which unpacks without limits, use the functions of this module."""
    frame, ros1, ros2, mcap = map(import_module, (
        'lz4.frame', 'rosbags.rosbag1.reader', 'rosbags.rosbag2.reader',
        'rosbags.rosbag2.storage_mcap'))
    zstd = ros2.zstd

    class Zstd:
        """The functions of the module zstd that rosbags uses."""

        @staticmethod
        def decompress(data: bytes) -> bytes:
            return unpack(zstd.ZstdDecompressor, data)

        @staticmethod
        def open(file: BinaryIO, mode: str) -> BinaryIO:
            content = zstd.open(file, mode)
            return content if mode != 'rb' else io.BufferedReader(_Unpacked(file, content))

    def lz4(data: bytes) -> bytes:
        return unpack(frame.LZ4FrameDecompressor, data)

    ros1.decompressors.update(bz2=lambda data: unpack(bz2.BZ2Decompressor, data), lz4=lz4)
    mcap.DECOMPRESSORS.update(lz4=lambda data, size: lz4(data),
                              zstd=lambda data, size: Zstd.decompress(data))
    setattr(ros2, 'zstd', Zstd)
