# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The messages of chunks are those that rosbags reads, and are limited in number."""

import importlib.util
import random
import struct
import zlib
from itertools import accumulate

import lz4.frame
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer, storage_mcap
from rosbags.typesys import Stores, get_typestore

from aick_ros.borders import chunk_messages
from aick_ros.borders.chunk_messages import limit_messages, read_messages
from aick_ros.errors import InputError

CHANNELS = {1: 'one', 2: 'two'}


def record(opcode, content):
    return struct.pack('<BQ', opcode, len(content)) + content


def message(channel, time, content):
    return record(5, struct.pack('<HIQQ', channel, 0, time, 0) + content)


@pytest.fixture(scope='module')
def records():
    """Return records of a chunk: messages of three channels, out of order, and others between."""
    generator = random.Random(0)
    return [message(generator.randint(1, 3), generator.randint(0, 9),
                    generator.randbytes(generator.randint(0, 20)))
            if generator.random() < 0.7 else record(4, generator.randbytes(5))
            for _ in range(60)]


@pytest.fixture
def bag_chunk(tmp_path, records):
    """Return a function that writes the chunk of the records, and returns its entry and file."""
    def write(compression='', pack=bytes, checksum=None):
        content = b''.join(records)
        packed = pack(content)
        checksum = zlib.crc32(content) if checksum is None else checksum
        name = compression.encode()
        path = tmp_path / 'chunk'
        path.write_bytes(b'before' + record(6, struct.pack('<QQQI', 0, 9, len(content), checksum)
                         + struct.pack('<I', len(name)) + name + struct.pack('<Q', len(packed))
                         + packed))
        return storage_mcap.ChunkInfo(0, 9, 6, path.stat().st_size - 6, {}, 0, compression,
                                      len(packed), len(content), {}), path
    return write


def by_rosbags(chunk, path):
    """Read the chunk by a copy of the module of rosbags that nothing has changed."""
    spec = importlib.util.find_spec('rosbags.rosbag2.storage_mcap')
    copy = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(copy)
    with path.open('rb') as file:
        return list(copy.msgsrc(chunk, CHANNELS, 2, 8, file))


@pytest.mark.parametrize('compression, pack', [('', bytes), ('lz4', lz4.frame.compress)])
def test_a_chunk_has_the_messages_that_rosbags_finds(bag_chunk, compression, pack):
    limit_messages()
    chunk, path = bag_chunk(compression, pack)
    with path.open('rb') as file:
        found = list(storage_mcap.msgsrc(chunk, CHANNELS, 2, 8, file))
    expected = by_rosbags(chunk, path)
    assert len(expected) > 10
    assert [(each.timestamp, each.connection, each.data) for each in found] == [
        (each.timestamp, each.connection, each.data) for each in expected]
    assert found[0].offset == 0 and all(each.offset for each in found[1:])


@pytest.mark.parametrize('changes, damage, reason', [
    ({'checksum': 1}, lambda chunk: chunk, 'another checksum'),
    ({}, lambda chunk: chunk._replace(uncompressed_size=chunk.uncompressed_size - 1), 'declared'),
    ({}, lambda chunk: chunk._replace(compressed_size=chunk.compressed_size + 1), 'truncated'),
    ({}, lambda chunk: chunk._replace(chunk_start_offset=10 ** 6), 'truncated'),
    ({'compression': 'odd'}, lambda chunk: chunk, "compression 'odd' is not known")])
def test_a_chunk_that_is_not_what_it_declares_is_rejected(bag_chunk, changes, damage, reason):
    limit_messages()
    chunk, path = bag_chunk(**changes)
    with path.open('rb') as file, pytest.raises(InputError, match=reason):
        list(storage_mcap.msgsrc(damage(chunk), CHANNELS, 0, 10, file))


def test_a_chunk_that_is_cut_within_a_record_is_rejected(records):
    content, ends = b''.join(records), {0, *accumulate(map(len, records))}
    whole = list(read_messages(content, CHANNELS))
    for end in range(len(content)):
        if end in ends:
            part = list(read_messages(content[:end], CHANNELS))
            assert part == whole[:len(part)]
        else:
            with pytest.raises(InputError, match='truncated'):
                list(read_messages(content[:end], CHANNELS))


def test_a_message_without_its_head_is_rejected():
    with pytest.raises(InputError, match='truncated'):
        list(read_messages(record(5, bytes(21)) + record(5, bytes(50)), CHANNELS))


def test_messages_of_the_channels_that_are_read_are_limited(monkeypatch):
    monkeypatch.setattr(chunk_messages, 'MAX_CHUNK_MESSAGES', 100)
    others = message(3, 0, b'') * 1000
    assert len(list(read_messages(others + message(1, 0, b'') * 100, CHANNELS))) == 100
    with pytest.raises(InputError, match='a chunk has more than 100 messages'):
        list(read_messages(others + message(1, 0, b'') * 60 + message(2, 0, b'') * 41, CHANNELS))


def test_a_bag_is_read_by_them(tmp_path):
    limit_messages()
    types = get_typestore(Stores.ROS2_JAZZY)
    kind = types.types['std_msgs/msg/String']
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic in ('/a', '/b'):
            connection = writer.add_connection(topic, kind.__msgtype__, typestore=types)
            for time in range(5):
                writer.write(connection, time, types.serialize_cdr(kind(f'{topic}{time}'),
                                                                   kind.__msgtype__))
    with AnyReader([tmp_path / 'bag']) as reader:
        texts = [reader.deserialize(content, connection.msgtype).data
                 for connection, _, content in reader.messages(
                     [each for each in reader.connections if each.topic == '/b'])]
    assert texts == [f'/b{time}' for time in range(5)]
