# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The parts of a bag are measured without being read."""

import os
import sqlite3
import struct
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from aick_ros.borders import bag_limits
from aick_ros.borders.bag_limits import check_bag, check_chunks
from aick_ros.borders.limits import (
    MAX_CHUNKS, MAX_MESSAGE_BYTES, MAX_METADATA_BYTES, MAX_UNPACKING, SMALL_CHUNK_BYTES)
from aick_ros.errors import InputError

MAGIC = b'\x89MCAP0\r\n'
ATTACHMENT = 9


def record(opcode, content=b'', length=None):
    return struct.pack('<BQ', opcode, len(content) if length is None else length) + content


def chunk(unpacked, packed=0):
    return record(6, struct.pack('<QQQII', 0, 0, unpacked, 0, 0) + bytes(8 + packed))


def write(path, *parts, size=None):
    path.write_bytes(b''.join(parts))
    if size:
        with open(path, 'r+b') as file:
            file.truncate(size)
    return path


@pytest.mark.parametrize('size', [MAX_MESSAGE_BYTES, MAX_MESSAGE_BYTES + 1])
@pytest.mark.parametrize('make', [
    lambda path, size: write(path / 'a.mcap', MAGIC, record(1, b'x'), chunk(size), record(2)),
    # no message, but rosbags reads all of it
    lambda path, size: write(path / 'a.mcap', MAGIC, record(3, length=size), size=size + 100),
    lambda path, size: write(path / 'a.bag', b'#ROSBAG V2.0\n', struct.pack('<I', 3), b'abc',
                             struct.pack('<I', size), size=size + 100),
    lambda path, size: write(path / 'a.bag', b'#ROSBAG V2.0\n', struct.pack('<I', size),
                             size=size + 100)])
def test_large_parts_are_rejected(tmp_path, make, size):
    path = make(tmp_path, size)
    for given in (path, tmp_path):
        if size <= MAX_MESSAGE_BYTES:
            check_bag(given)
            continue
        with pytest.raises(InputError, match=f'has a message or chunk of {size} bytes: at most'):
            check_bag(given)


def test_chunks_are_counted_though_they_are_empty(tmp_path):
    check_bag(write(tmp_path / 'few.mcap', MAGIC, chunk(0) * MAX_CHUNKS))
    path = write(tmp_path / 'many.mcap', MAGIC, chunk(0) * (MAX_CHUNKS + 1))
    with pytest.raises(InputError) as raised:
        check_bag(path)
    assert str(raised.value) == (
        f'{path} has more than 262144 small chunks: record it again, with larger ones')


def test_a_long_recording_has_as_many_chunks_as_it_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(bag_limits, 'MAX_CHUNKS', 50)
    large, small = (write(tmp_path / f'{size}.mcap', MAGIC, chunk(size, size) * 60)
                    for size in (SMALL_CHUNK_BYTES, SMALL_CHUNK_BYTES // 2))
    check_bag(large)
    with pytest.raises(InputError, match='more than 50 small chunks'):
        check_bag(small)


@pytest.mark.parametrize('name, magic', [('a.mcap', MAGIC), ('a.bag', b'#ROSBAG V2.0\n')])
def test_zeros_take_no_time(tmp_path, name, magic):
    check_bag(write(tmp_path / name, magic, size=2 ** 40))  # of which the disk has none


def listed(path, *files, storage='mcap'):
    """Write the metadata of a bag of these files, and return its folder."""
    path.mkdir(exist_ok=True)
    write(path / 'metadata.yaml', yaml.safe_dump({'rosbag2_bagfile_information': {
        'storage_identifier': storage, 'relative_file_paths': list(files)}}).encode())
    return path


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('make', [
    os.mkfifo, Path.mkdir, lambda path: path.symlink_to('/dev/zero')])
def test_files_of_the_metadata_are_checked_whatever_their_name(tmp_path, make, storage):
    path = listed(tmp_path / 'bag', 'a.mcap.zstd', storage=storage)
    make(path / 'a.mcap.zstd')
    with pytest.raises(InputError, match='a.mcap.zstd: it is not a regular file$'):
        check_bag(path)


def test_files_without_suffix_are_measured(tmp_path):
    path = listed(tmp_path / 'bag', 'elsewhere/data')
    write(path / 'data', MAGIC, chunk(MAX_MESSAGE_BYTES + 1))
    with pytest.raises(InputError, match='has a message or chunk of'):
        check_bag(path)


@pytest.mark.parametrize('again', ['a.mcap', 'x/../a.mcap', 'link.mcap'])
def test_a_file_is_read_once(tmp_path, again):
    """Or a list of 50,000 lines would make hours of a second."""
    path = listed(tmp_path / 'bag', 'a.mcap', again)
    write(path / 'a.mcap', MAGIC)
    (path / 'link.mcap').symlink_to('a.mcap')
    with pytest.raises(InputError) as raised:
        check_bag(path)
    assert str(raised.value) == (f"{path}: its metadata list '{Path(again).name}' twice; run "
                                 '`ros2 bag reindex` on it')


def test_files_that_are_missing_are_left_to_the_reader(tmp_path):
    check_bag(listed(tmp_path / 'bag', 'a.mcap', 'a.mcap', 'a' * 999, 'a\0b'))


def test_a_first_line_without_end_is_not_read(tmp_path):
    path = write(tmp_path / 'a.bag', size=2 ** 40)
    with pytest.raises(InputError) as raised:
        check_bag(path)
    assert str(raised.value) == (f"{path} is not a ROS 1 bag: its first line is not '#ROSBAG "
                                 "V2.0'; give a recording")


def test_attachments_may_be_large(tmp_path):
    large = MAX_MESSAGE_BYTES + 1
    check_bag(write(tmp_path / 'a.mcap', MAGIC, record(ATTACHMENT, length=large), size=large + 99))


@pytest.mark.parametrize('content', [
    b'', b'\x89MCAP0', MAGIC, MAGIC + b'\6', MAGIC + chunk(9)[:20],
    MAGIC + record(5, length=2 ** 63), b'#ROSBAG V2.0\n\1\0'])
@pytest.mark.parametrize('suffix', ['mcap', 'db3', 'bag'])
def test_other_damage_is_left_to_the_reader(tmp_path, content, suffix):
    path = write(tmp_path / f'a.{suffix}', content)
    if suffix == 'mcap' and len(content) > 16 and content[8] == 5:
        with pytest.raises(InputError, match='message or chunk'):
            check_bag(path)
    else:
        check_bag(path)


def test_names_in_no_encoding_are_left_to_the_reader(tmp_path):
    path = tmp_path / 'a.db3'
    with closing(sqlite3.connect(path)) as connection:
        connection.execute('CREATE TABLE messages(data BLOB)')
        connection.execute('CREATE INDEX named ON messages(data)')
        connection.commit()
    path.write_bytes(path.read_bytes().replace(b'INDEX named ON', b'IND\xe8X named ON'))
    check_bag(path)


@pytest.mark.parametrize('statement', [
    'CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) '
    "SELECT i AS id, i AS timestamp, 1 AS topic_id, x'00' AS data FROM n",
    'CREATE VIRTUAL TABLE messages USING fts5(data)'])
def test_tables_that_never_end_are_rejected(tmp_path, statement):
    path = tmp_path / 'a.db3'
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(statement)
        connection.commit()
    with pytest.raises(InputError, match='has views or virtual tables, which no bag has: record '
                                         'it again$'):
        check_bag(path)


@pytest.mark.parametrize('column', ['name', 'type', 'offered_qos_profiles'])
@pytest.mark.parametrize('columns', [('name', 'type'), ('name', 'type', 'offered_qos_profiles')])
@pytest.mark.parametrize('size, is_large', [(500, False), (501, True)])
def test_topics_are_described_in_few_words(tmp_path, monkeypatch, column, columns, size, is_large):
    """Bags of the first versions have no QoS."""
    monkeypatch.setattr(bag_limits, 'MAX_METADATA_BYTES', 1000)
    path = tmp_path / 'a.db3'
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f'CREATE TABLE topics({", ".join(columns)})')
        connection.execute('CREATE TABLE messages(data BLOB)')
        for _ in range(2):
            connection.execute(f'INSERT INTO topics({columns[0]}) VALUES (NULL)')
        if column in columns:
            connection.execute(f"UPDATE topics SET {column} = printf('%.*c', {size}, '-')")
        connection.commit()
    if is_large and column in columns:
        with pytest.raises(InputError) as raised:
            check_bag(path)
        assert str(raised.value) == (f'{path} describes its topics in more than 1000 bytes: '
                                     'record it again')
    else:
        check_bag(path)


def database(path, *sizes):
    with closing(sqlite3.connect(path)) as connection:
        connection.execute('CREATE TABLE messages(data BLOB)')
        connection.executemany('INSERT INTO messages VALUES (zeroblob(?))',
                               [(size,) for size in sizes])
        connection.commit()


@pytest.mark.parametrize('sizes, is_large', [((), False), ((3, 1000, 2), False),
                                             ((3, 1001, 2), True)])
def test_the_largest_row_of_a_database_counts(tmp_path, monkeypatch, sizes, is_large):
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', 1000)
    database(tmp_path / 'a#1.db3', *sizes)
    if not is_large:
        check_bag(tmp_path)
        return
    with pytest.raises(InputError) as raised:
        check_bag(tmp_path)
    assert str(raised.value) == (
        f'{tmp_path}/a#1.db3 has a message or chunk of 1001 bytes: at most 1000 are supported: '
        'copy or record it again')


@pytest.mark.parametrize('index', range(3))
def test_any_record_may_be_the_largest(tmp_path, monkeypatch, index):
    """Of an MCAP file, and of a bag of ROS 1: a header, or the data after it."""
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', 50)
    sizes = [10, 20, 30]
    sizes[index] = 51
    records = [record(1, bytes(size)) for size in sizes]
    parts = [struct.pack('<I', size) + bytes(size) for size in [4, *sizes]]
    for path in (write(tmp_path / 'a.mcap', MAGIC, *records),
                 write(tmp_path / 'a.bag', b'#ROSBAG V2.0\n', *parts)):
        with pytest.raises(InputError, match='of 51 bytes'):
            check_bag(path)


def test_what_comes_after_a_chunk_counts(tmp_path, monkeypatch):
    """The records in a chunk are not those after it."""
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', 500)
    inside = struct.pack('<QQQII', 0, 0, 9, 0, 0) + b'\1' + b'\xff' * 200
    check_bag(write(tmp_path / 'a.mcap', MAGIC, record(6, inside), record(1, bytes(20))))
    with pytest.raises(InputError, match='of 501 bytes'):
        check_bag(write(tmp_path / 'b.mcap', MAGIC, record(6, inside), record(1, bytes(501))))


def test_other_files_in_the_folder_may_have_any_size(tmp_path):
    write(tmp_path / 'notes.txt', size=2 ** 40)
    write(tmp_path / 'a.mcap.zstd', size=2 ** 40)
    check_bag(tmp_path)


def test_metadata_up_to_the_limit_is_read(tmp_path):
    write(tmp_path / 'metadata.yaml', bytes(MAX_METADATA_BYTES))
    check_bag(tmp_path)
    write(tmp_path / 'metadata.yaml', bytes(MAX_METADATA_BYTES + 1))
    with pytest.raises(InputError, match='cannot read the metadata'):
        check_bag(tmp_path)


def indexed(*chunks):
    return [SimpleNamespace(message_start_time=start, message_end_time=end, compressed_size=packed,
                            uncompressed_size=size) for start, end, packed, size in chunks]


@pytest.mark.parametrize('chunks, is_accepted', [
    ([(0, 9, 1, MAX_MESSAGE_BYTES)], True), ([(0, 9, 1, MAX_MESSAGE_BYTES + 1)], False),
    ([(0, 9, MAX_MESSAGE_BYTES + 1, 1)], False),
    ([(3, 4, 1, MAX_MESSAGE_BYTES), (0, 2, 1, 0)], True),
    ([(2, 4, 1, MAX_MESSAGE_BYTES), (0, 2, 1, 1)], False),
    ([(0, 9, 1, MAX_MESSAGE_BYTES // 2), (1, 2, 1, MAX_MESSAGE_BYTES // 2), (4, 5, 1, 0)], True),
    ([(0, 9, 1, MAX_MESSAGE_BYTES // 3 + 1)] * 3, False),
    ([(0, 2 ** 64 - 1, 1, 0)] * 100_000, True)])
def test_chunks_of_one_time_are_limited_together(tmp_path, chunks, is_accepted):
    path = write(tmp_path / 'a.mcap', size=MAX_MESSAGE_BYTES)  # of which the disk has none
    if is_accepted:
        check_chunks(path, indexed(*chunks))
    else:
        with pytest.raises(InputError, match=(
                f'of more than {MAX_MESSAGE_BYTES} bytes for one time: '
                'record it again, with smaller chunks$')):
            check_chunks(path, indexed(*chunks))


@pytest.mark.parametrize('size', [0, 4 * MAX_MESSAGE_BYTES // MAX_UNPACKING])
def test_all_chunks_are_limited_by_the_size_of_the_file(tmp_path, size):
    path = write(tmp_path / 'a.mcap', size=size)
    chunks = [(2 * number, 2 * number + 1, 1, MAX_MESSAGE_BYTES) for number in range(4)]
    check_chunks(path, indexed(*chunks[:3 if size else 1]))
    with pytest.raises(InputError, match=f'unpacks to more than {MAX_UNPACKING} times its size: '
                                         'record it again$'):
        check_chunks(path, indexed(*chunks, (9, 9, 1, 99)))
