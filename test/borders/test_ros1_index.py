# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The index of a ROS 1 bag is read within limits, and sound bags as before."""

import struct

import pytest
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

from aick_ros.borders import ros1_index
from aick_ros.borders.ros1_index import limit_chunks, limit_index
from aick_ros.errors import InputError

MESSAGES = 100
CONTENT = struct.pack('<I', 36) + bytes(36)
CHUNK_INFO = b'op=\x06'


@pytest.fixture
def bag(tmp_path):
    """Return the path of a bag of two chunks with messages at the even and the odd times."""
    limit_index()
    with Writer(path := tmp_path / 'a.bag') as writer:
        writer.chunk_threshold = MESSAGES // 2 * len(CONTENT)
        topic = writer.add_connection('/a', 'std_msgs/msg/String',
                                      typestore=get_typestore(Stores.ROS1_NOETIC))
        for time in (*range(0, MESSAGES, 2), *range(1, MESSAGES, 2)):
            writer.write(topic, time, CONTENT)
    return path


def times(path):
    with Reader(path) as reader:
        assert 2 <= len(reader.chunks) <= 6
        limit_chunks(reader, path)
        return [time for _, time, content in reader.messages() if content == CONTENT]


def repeat_index(path, times):
    """Let the index of a bag name its first chunk so many times."""
    content = path.read_bytes()
    start = content.index(CHUNK_INFO) - 8  # the lengths of the header and of its first field
    end = content.find(CHUNK_INFO, start + 12) - 8
    count = content.index(b'chunk_count=') + len(b'chunk_count=')
    path.write_bytes(content[:count] + struct.pack('<I', times) + content[count + 4:start]
                     + times * content[start:end])


def test_a_sound_bag_is_read_whole_and_again(bag):
    for _ in range(2):
        assert times(bag) == list(range(MESSAGES))


def test_an_index_that_names_chunks_again_and_again_is_rejected(bag):
    repeat_index(bag, times=1000)
    with pytest.raises(InputError, match='^its index names chunks again and again$'):
        Reader(bag).open()


def test_small_messages_are_counted(bag, monkeypatch):
    monkeypatch.setattr(ros1_index, 'MAX_INDEXED_MESSAGES', MESSAGES // 2)
    with pytest.raises(InputError, match='^its index has more than [0-9]+ messages$'):
        monkeypatch.setattr(ros1_index, 'MEAN_MESSAGE_BYTES', 10 ** 6)
        Reader(bag).open()
    monkeypatch.setattr(ros1_index, 'MEAN_MESSAGE_BYTES', len(CONTENT))  # they are large now
    assert times(bag) == list(range(MESSAGES))


def test_a_record_that_breaks_off_is_left_to_the_reader(bag):
    content = bag.read_bytes()
    bag.write_bytes(content.replace(b'op=\x04', b'op=\x09'))
    with pytest.raises(Exception) as raised:
        Reader(bag).open()
    assert not isinstance(raised.value, InputError)


def test_chunks_that_are_unpacked_again_and_again_are_counted(bag, monkeypatch):
    monkeypatch.setattr(ros1_index, 'MAX_UNPACKING', 1)
    monkeypatch.setattr(ros1_index, '_LEAST_UNPACKED', 0)
    with pytest.raises(InputError) as raised:
        times(bag)
    assert str(raised.value) == ('its messages alternate between chunks, so that it unpacks to '
                                 'more than 1 times its size')
