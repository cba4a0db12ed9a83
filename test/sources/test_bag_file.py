# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of a bag in their order, and one sentence for whatever is wrong."""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from aick_ros.borders import bag_limits
from aick_ros.errors import InputError
from aick_ros.sources import bag_file, raise_damage
from aick_ros.sources.bag_file import BagFile, stamp_of
from aick_ros.sources.writers.bag_messages import TYPESTORE

TEXT = 'std_msgs/msg/String'


def write(path, messages, storage=StoragePlugin.MCAP, definition='string data\n'):
    """Write texts (topic, log time, text); bytes are written as they are."""
    connections = {}
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for topic, log_time, text in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, TEXT, msgdef=definition, rihs01=TYPESTORE.hash_rihs01(TEXT))
            content = text if isinstance(text, bytes) else TYPESTORE.serialize_cdr(
                TYPESTORE.types[TEXT](text), TEXT)
            writer.write(connections[topic], log_time, content)
    return path


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / 'bag', [
        ('/b', 30, 'third'), ('/a', 10, 'first'), ('/c', 25, 'other'), ('/a', 20, 'second')])


def test_messages_of_the_topics_come_in_the_order_of_recording(bag):
    messages = list(BagFile(bag).messages(['/a', '/b'], raise_damage))
    assert [(each.topic, each.log_time, each.content.data) for each in messages] == [
        ('/a', 10, 'first'), ('/a', 20, 'second'), ('/b', 30, 'third')]


@pytest.mark.parametrize('topics', [[], ['/nowhere']])
def test_no_topic_has_no_messages(bag, topics):
    assert list(BagFile(bag).messages(topics, raise_damage)) == []


def test_topics_have_types_and_numbers(bag):
    topics = BagFile(bag).topics()
    assert {name: (topic.msgtype, topic.msgcount) for name, topic in topics.items()} == {
        '/a': (TEXT, 2), '/b': (TEXT, 1), '/c': (TEXT, 1)}


def test_a_bag_is_read_anew_each_time(bag):
    file = BagFile(bag)
    first = next(file.messages(['/a'], raise_damage))
    assert [each.content.data for each in file.messages(['/a'], raise_damage)] == [
        'first', 'second']
    assert first.content.data == 'first'


def test_a_file_that_is_removed_while_the_bag_is_opened(bag, monkeypatch):
    def check(storage):
        file = storage.storages[0].path
        file.unlink()
        bag_limits.check_indexes(storage)

    monkeypatch.setattr(bag_file, 'check_indexes', check)
    with pytest.raises(InputError, match='cannot be read as a bag .*No such file or directory'):
        BagFile(bag).topics()


def test_a_damaged_message_is_reported_and_the_next_one_read(tmp_path):
    damaged = TYPESTORE.serialize_cdr(TYPESTORE.types[TEXT]('abc'), TEXT)[:6]
    bag = write(tmp_path / 'bag', [
        ('/a', 1_000_000_000, 'one'), ('/a', 2_500_000_000, bytes(damaged)), ('/a', 3, 'x')])
    errors = []
    messages = list(BagFile(bag).messages(['/a'], errors.append))
    assert [each.content.data for each in messages] == ['x', 'one']
    assert len(errors) == 1 and isinstance(errors[0], InputError)
    assert str(errors[0]).startswith(f'{bag}, /a recorded at 2.5')
    with pytest.raises(InputError, match=(
            r'the message is damaged \(.*\); copy or record it again')):
        list(BagFile(bag).messages(['/a'], raise_damage))


@pytest.mark.parametrize('storage', StoragePlugin)
@pytest.mark.parametrize('definition, reason', [
    ('string[1000000000] data\n', 'more than 1000 fields, elements of arrays included'),
    ('#\n' * 1_000_000 + 'string data\n', 'more than 131072 lines')])
def test_definitions_are_limited(tmp_path, storage, definition, reason):
    bag = write(tmp_path / 'bag', [('/a', 1, 'one')], storage, definition)
    text = (bag / 'metadata.yaml').read_text()
    (bag / 'metadata.yaml').write_text(text.replace('type_description_hash', 'unused'))
    with pytest.raises(InputError, match=f'{reason}.*: copy or record it again'):
        list(BagFile(bag).messages(['/a'], raise_damage))


def test_metadata_is_limited(bag):
    with open(bag / 'metadata.yaml', 'a') as file:
        file.write('a: &a [x, x]\nb: *a\n')
    with pytest.raises(InputError, match='its YAML has aliases, which no bag has'):
        BagFile(bag).topics()


def test_chunks_of_one_time_are_limited(bag, monkeypatch):
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', 50)
    file = BagFile.__new__(BagFile)
    file._path = bag
    with pytest.raises(InputError, match='bag.mcap has chunks of more than 50 bytes for one time'):
        file.topics()


@pytest.mark.parametrize('storage, suffix', [(StoragePlugin.MCAP, 'mcap'),
                                             (StoragePlugin.SQLITE3, 'db3')])
@pytest.mark.parametrize('name', ['bag', 'folder.bag'])
def test_a_folder_with_one_storage_file_needs_no_metadata(tmp_path, storage, suffix, name):
    folder = write(tmp_path / name, [('/a', 1, 'one')], storage)
    (folder / 'notes.txt').write_text('mine')
    (folder / 'metadata.yaml').unlink()
    message, = BagFile(folder).messages(['/a'], raise_damage)
    assert message.content.data == 'one'


def test_a_folder_that_ends_as_a_file_does_is_read_by_its_storage_file(tmp_path):
    """Its metadata would have it read as a bag of ROS 1."""
    folder = write(tmp_path / 'folder.bag', [('/a', 1, 'one')])
    assert (folder / 'metadata.yaml').exists()
    assert len(list(BagFile(folder).messages(['/a'], raise_damage))) == 1


@pytest.mark.parametrize('name, count, sentence', [
    ('folder', 0, 'has 0 storage files and no metadata.yaml: run `ros2 bag reindex'),
    ('folder', 2, 'has 2 storage files and no metadata.yaml: run `ros2 bag reindex'),
    ('folder.bag', 0, 'is a folder that ends in .bag: rename it'),
    ('folder.bag', 2, 'is a folder that ends in .bag: rename it')])
def test_other_folders_say_what_to_do(tmp_path, name, count, sentence):
    folder = tmp_path / name
    folder.mkdir()
    for number in range(count):
        (folder / f'{number}.mcap').touch()
    with pytest.raises(InputError) as caught:
        BagFile(folder)
    assert str(caught.value).startswith(f'{folder} {sentence}')


def test_stamps_lose_no_nanosecond():
    time = SimpleNamespace(sec=np.int32(2_147_483_647), nanosec=np.uint32(999_999_999))
    stamp = stamp_of(SimpleNamespace(header=SimpleNamespace(stamp=SimpleNamespace(
        sec=int(time.sec), nanosec=int(time.nanosec)))))
    assert stamp == 2_147_483_647_999_999_999


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_is_closed_when_it_has_been_read_or_is_read_no_further(tmp_path, storage):
    bag = write(tmp_path / 'bag', [('/a', 1, 'one'), ('/a', 2, 'two')], storage)

    def is_open():
        links = (os.readlink(entry) for entry in Path('/proc/self/fd').iterdir()
                 if entry.is_symlink())
        return any(link.startswith(str(tmp_path)) for link in links)

    messages = BagFile(bag).messages(['/a'], raise_damage)
    next(messages)
    assert is_open()
    messages.close()
    assert not is_open()
    assert len(list(BagFile(bag).messages(['/a'], raise_damage))) == 2
    BagFile(bag).topics()
    assert not is_open()


def test_sentences_about_a_bag_are_whole(tmp_path):
    bag = write(tmp_path / 'bag', [('/a', 1, 'one')], definition='string text\n')
    file, = bag.glob('*.mcap')
    with pytest.raises(InputError) as raised:
        list(BagFile(file).messages(['/a'], raise_damage))
    assert str(raised.value) == (
        f'{file}, /a: the messages are not of the type that they are declared as ({TEXT} has no '
        'data): choose another topic, or record with the standard definition')
    (tmp_path / 'folder').mkdir()
    with pytest.raises(InputError) as raised:
        BagFile(tmp_path / 'folder')
    assert str(raised.value) == (
        f'{tmp_path}/folder has 0 storage files and no metadata.yaml: run `ros2 bag reindex '
        f'{tmp_path}/folder`, or give one of the files')
