# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sizes in a bag, checked by the headers of its files before anything is unpacked."""

from __future__ import annotations

import sqlite3
import struct
from pathlib import Path
from typing import BinaryIO

from aick_ros.borders.limits import MAX_MESSAGE_BYTES
from aick_ros.errors import InputError

_MCAP_MAGIC = b'\x89MCAP0\r\n'
_MESSAGE, _CHUNK = 5, 6  # opcodes of MCAP
_RECORD = struct.Struct('<BQ')  # opcode, bytes
_CHUNK_HEAD = struct.Struct('<QQQII')  # first and last stamp, unpacked bytes, CRC, name's bytes
_ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
_ZSTD_SIZES = {0: '<B', 1: '<H', 2: '<I', 3: '<Q'}


def check_storage(path: Path) -> None:
    """
    Check a storage file of a ROS 2 bag; damage of other kinds is left to the reader.

    :raises InputError: where it is not a regular file, or a message or a chunk is too large.
    """
    if not path.is_file():
        raise InputError(f'cannot read {path}: it is not a regular file')
    try:
        largest = _largest_row(path) if path.suffix == '.db3' else _largest_record(path)
    except OSError as error:
        raise InputError(f'cannot read {path}: {error.strerror}') from None
    except (sqlite3.Error, struct.error):
        return
    if largest > MAX_MESSAGE_BYTES:
        raise InputError(f'{path} has a message or chunk of {largest} bytes: at most '
                         f'{MAX_MESSAGE_BYTES} are supported')


def _largest_row(path: Path) -> int:
    """Return the bytes of the largest message of an SQLite bag, without reading it."""
    connection = sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro&immutable=1', uri=True)
    try:
        return int(connection.execute('SELECT MAX(LENGTH(data)) FROM messages').fetchone()[0] or 0)
    finally:
        connection.close()


def _largest_record(path: Path) -> int:
    """Return the bytes of the largest message or unpacked chunk of an MCAP file."""
    largest, size = 0, path.stat().st_size
    with open(path, 'rb') as file:
        if file.read(len(_MCAP_MAGIC)) != _MCAP_MAGIC:
            return 0
        while (start := file.tell()) + _RECORD.size <= size:
            opcode, length = _RECORD.unpack(file.read(_RECORD.size))
            if opcode in (_MESSAGE, _CHUNK):
                largest = max(largest, length)
            if opcode == _CHUNK:
                largest = max(largest, _unpacked_size(file))
            if length > size:  # damaged
                break
            file.seek(start + _RECORD.size + length)
    return largest


def _unpacked_size(file: BinaryIO) -> int:
    """Return the unpacked bytes of the chunk that begins here: the larger of its two headers."""
    size: int
    *_, size, _, name_length = _CHUNK_HEAD.unpack(file.read(_CHUNK_HEAD.size))
    if file.read(min(name_length, 8)) != b'zstd':
        return size
    file.seek(8, 1)  # bytes of the packed data
    return max(size, _zstd_size(file.read(18)))


def _zstd_size(frame: bytes) -> int:
    """Return the unpacked bytes that a zstd frame declares (RFC 8878, 3.1.1.1); 0: none."""
    if not frame.startswith(_ZSTD_MAGIC):
        return 0
    flags = frame[4]
    is_single, dictionary = bool(flags & 0x20), (0, 1, 2, 4)[flags & 3]
    kind = flags >> 6
    if kind == 0 and not is_single:
        return 0
    start = 5 + (not is_single) + dictionary
    return int(struct.unpack_from(_ZSTD_SIZES[kind], frame, start)[0]) + (256 if kind == 1 else 0)
