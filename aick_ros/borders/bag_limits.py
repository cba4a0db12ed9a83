# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sizes in a bag, checked by the headers of its files before anything is unpacked."""

from __future__ import annotations

import heapq
import sqlite3
import struct
from collections.abc import Iterable
from contextlib import closing, suppress
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO, Protocol

from aick_ros.borders.bag_metadata import listed_files
from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import (
    MAX_CHUNKS, MAX_MESSAGE_BYTES, MAX_METADATA_BYTES, MAX_UNPACKING, SMALL_CHUNK_BYTES)
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError

_MCAP_MAGIC = b'\x89MCAP0\r\n'
_CHUNK, _ATTACHMENT = 6, 9  # opcodes of MCAP
_RECORD = struct.Struct('<BQ')  # opcode, bytes
_CHUNK_HEAD = struct.Struct('<QQQ')  # first and last stamp, unpacked bytes
_ROS1_MAGIC = b'#ROSBAG V2.0\n'
_ROS1_LENGTH = struct.Struct('<I')


def check_bag(path: Path) -> None:
    """
    Check the files of a bag; damage of other kinds is left to the reader.

    :param path: folder of a ROS 2 bag, one of its .mcap or .db3 files, or a .bag file.
    :raises InputError: where a file is not a regular file, a message or a chunk is too large, or
        there are too many chunks.
    """
    for file in [path] if not path.is_dir() else sorted(path.iterdir()):
        if file.suffix in _LARGEST:
            _check_storage(file, file.suffix)
        elif file.name == 'metadata.yaml':
            _check_listed(path, read_bytes(file, 'the metadata', MAX_METADATA_BYTES))


def _check_listed(folder: Path, metadata: bytes) -> None:
    """Check the files that the metadata list, whatever they are called: rosbags reads each."""
    suffix, names = listed_files(metadata)
    known = set[tuple[int, int]]()
    for name in names:
        try:
            status = (folder / name).stat()
        except (OSError, ValueError):  # it is missing, or has NUL in its name
            continue
        if (status.st_dev, status.st_ino) in known:
            raise InputError(f'{folder}: its metadata list {quoted(name)} twice; run `ros2 bag '
                             'reindex` on it')
        known.add((status.st_dev, status.st_ino))
        _check_storage(folder / name, suffix)


class Chunk(Protocol):
    """An entry of the index of an MCAP file, by which it is read; it may name any chunk often."""

    message_start_time: int
    message_end_time: int
    compressed_size: int
    uncompressed_size: int


def check_chunks(path: Path, chunks: Iterable[Chunk]) -> None:
    """
    Check the index of an MCAP file: those of one time are unpacked together.

    :raises InputError: where chunks are too large, alone, in all, or those of one time.
    """
    total = together = 0
    most = max(MAX_MESSAGE_BYTES, MAX_UNPACKING * path.stat().st_size)
    ends = list[tuple[int, int]]()  # of the chunks at a time, with their sizes
    for chunk in sorted(chunks, key=attrgetter('message_start_time')):
        while ends and ends[0][0] < chunk.message_start_time:
            together -= heapq.heappop(ends)[1]
        heapq.heappush(ends, (chunk.message_end_time, chunk.uncompressed_size))
        together += chunk.uncompressed_size
        total += chunk.uncompressed_size
        if max(together, chunk.compressed_size) > MAX_MESSAGE_BYTES:
            raise InputError(f'{path} has chunks of more than {MAX_MESSAGE_BYTES} bytes for one '
                             'time: record it again, with smaller chunks')
        if total > most:
            raise InputError(f'{path} unpacks to more than {MAX_UNPACKING} times its size: record '
                             'it again')


def check_indexes(storage: Any) -> None:
    """
    Check the MCAP files of a bag, which rosbags has opened, as :func:`check_chunks` does each.

    :param storage: that of a reader of ROS 2 bags: of a folder, or of one file.
    :raises InputError: where the chunks of a file are too large.
    """
    for file in getattr(storage, 'storages', [storage]):
        check_chunks(Path(file.path), getattr(file, 'chunks', ()))


def _check_storage(path: Path, suffix: str) -> None:
    """Check a file, which need not have the suffix of its kind."""
    if not path.is_file():
        raise InputError(f'cannot read {path}: it is not a regular file')
    try:
        largest = _LARGEST[suffix](path)
    except OSError as error:
        raise InputError(f'cannot read {path}: {error.strerror}') from None
    except (sqlite3.Error, struct.error, UnicodeError):  # the last by sqlite3's own messages
        return
    if largest > MAX_MESSAGE_BYTES:
        raise InputError(f'{path} has a message or chunk of {largest} bytes: at most '
                         f'{MAX_MESSAGE_BYTES} are supported: copy or record it again')


def _largest_row(path: Path) -> int:
    """Return the bytes of the largest message of an SQLite bag, without reading it."""
    with closing(sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro&immutable=1',
                                 uri=True)) as connection:
        # a view, or a table that a program makes up, may have rows without end
        if connection.execute("SELECT 1 FROM sqlite_master WHERE type = 'view' OR sql LIKE "
                              "'CREATE VIRTUAL%'").fetchone():
            raise InputError(f'{path} has views or virtual tables, which no bag has: record it '
                             'again')
        # TOTAL adds no NULL; a column may be missing in older bags, others than these are not read
        for column in ('name', 'type', 'offered_qos_profiles'):
            with suppress(sqlite3.Error):
                length = f'SELECT TOTAL(LENGTH({column})) FROM topics'
                if connection.execute(length).fetchone()[0] > MAX_METADATA_BYTES:
                    raise InputError(f'{path} describes its topics in more than '
                                     f'{MAX_METADATA_BYTES} bytes: record it again')
        return int(connection.execute('SELECT MAX(LENGTH(data)) FROM messages').fetchone()[0] or 0)


def _largest_record(path: Path) -> int:
    """Return the bytes of the largest record or unpacked chunk of an MCAP file."""
    largest = chunks = 0
    size = path.stat().st_size
    with open(path, 'rb') as file:
        if file.read(len(_MCAP_MAGIC)) != _MCAP_MAGIC:
            return 0
        while (start := file.tell()) + _RECORD.size <= size:
            opcode, length = _RECORD.unpack(file.read(_RECORD.size))
            if opcode != _ATTACHMENT:  # which nothing reads
                largest = max(largest, length)
            if opcode == _CHUNK:
                *_, unpacked = _CHUNK_HEAD.unpack(file.read(_CHUNK_HEAD.size))
                largest = max(largest, unpacked)
                # rosbags reads each of them, though it be empty
                if chunks >= MAX_CHUNKS and start < chunks * SMALL_CHUNK_BYTES:
                    raise InputError(f'{path} has more than {MAX_CHUNKS} small chunks: record it '
                                     'again, with larger ones')
                chunks += 1
            if not opcode or length > size:  # damaged, or zeros without end
                break
            file.seek(start + _RECORD.size + length)
    return largest


def _largest_ros1_record(path: Path) -> int:
    """Return the bytes of the largest header or data of a record, packed, of a ROS 1 bag."""
    largest, size = 0, path.stat().st_size
    with open(path, 'rb') as file:
        if (magic := file.read(len(_ROS1_MAGIC))) != _ROS1_MAGIC:
            if len(magic) == len(_ROS1_MAGIC) and b'\n' not in magic:  # rosbags reads that line
                raise InputError(f'{path} is not a ROS 1 bag: its first line is not '
                                 f'{_ROS1_MAGIC.decode().strip()!r}; give a recording')
            return 0
        while file.tell() + _ROS1_LENGTH.size <= size:
            header = _skip_part(file)
            largest = max(largest, header, _skip_part(file))
            if not header:  # zeros without end
                break
    return largest


def _skip_part(file: BinaryIO) -> int:
    """Skip a header or the data after it, and return its bytes."""
    length: int
    length, = _ROS1_LENGTH.unpack(file.read(_ROS1_LENGTH.size))
    file.seek(length, 1)
    return length


_LARGEST = {'.mcap': _largest_record, '.db3': _largest_row, '.bag': _largest_ros1_record}
"""Suffix of a storage file -> function that returns the bytes of its largest part."""
