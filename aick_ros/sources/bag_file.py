# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The messages of a ROS 1 or ROS 2 bag, with errors that say what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection, TopicInfo
from rosbags.typesys import Stores, get_typestore

from aick_ros.borders.bag_limits import check_indexes
from aick_ros.borders.bag_reading import prepare_to_read
from aick_ros.borders.definitions import check_fields, definitions_counted, limit_definitions
from aick_ros.borders.ros1_index import limit_chunks
from aick_ros.errors import InputError
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import stamp_to_seconds
from aick_ros.sources import OnDamaged
from aick_ros.sources.standard_definitions import difference

_REPAIR = ('copy or record it again, or repair it (`ros2 bag reindex` for a ROS 2 bag, `mcap '
           'recover` for an mcap file, `rosbag reindex` for a ROS 1 bag)')


class BagMessage(NamedTuple):
    """A deserialised message, and when it was recorded [ns]."""

    topic: str
    log_time: int
    content: Any


class BagFile:
    """
    A bag on disk; every read opens it anew.

    :param path: folder of a ROS 2 bag, one of its .mcap or .db3 files, or a .bag file. A folder
        without metadata.yaml is accepted where it has one storage file.
    """

    def __init__(self, path: Path) -> None:
        self._path = _storage(path)
        prepare_to_read(self._path)
        limit_definitions()

    def topics(self) -> dict[str, TopicInfo]:
        """
        Return the topics in the index of the bag, with type and number of messages.

        :raises InputError: where the bag cannot be read.
        """
        with self._open() as reader:
            try:
                topics = reader.topics
            except Exception as error:  # counts of messages that are no numbers
                raise self._unreadable(error) from None
            for name, topic in topics.items():
                count = topic.msgcount
                if not isinstance(count, int) or not 0 <= count < 2 ** 63:
                    raise InputError(f'{self._path}: its metadata counts {count!r} messages on '
                                     f'{name}; run `ros2 bag reindex` on it')
            return topics

    def messages(self, topics: list[str], on_damaged: OnDamaged) -> Iterator[BagMessage]:
        """
        Yield the messages in the order in which they were recorded.

        :param on_damaged: called with the error of each message that cannot be deserialised.
        :raises InputError: where the bag cannot be read to its end, or defines messages of ROS
            otherwise than ROS does.
        """
        with self._open() as reader:
            connections = [connection for connection in reader.connections
                           if connection.topic in topics]
            self._check_definitions(reader, connections)
            messages = reader.messages(connections)
            while connections:  # of none, the reader would yield all messages
                try:
                    connection, log_time, content = next(messages)
                except StopIteration:
                    return
                except Exception as error:
                    raise self._unreadable(error) from None
                if connection.topic not in topics:  # as the message says, not the index
                    raise self._unreadable(ValueError(
                        f'its index has a message of {connection.topic} as one of another topic'))
                try:
                    message = reader.deserialize(content, connection.msgtype)
                except Exception as error:
                    on_damaged(InputError(
                        f'{self._path}, {connection.topic} recorded at '
                        f'{stamp_to_seconds(log_time)}: the message is damaged '
                        f'({_reason(error)}); {_REPAIR}'))
                else:
                    yield BagMessage(connection.topic, log_time, message)

    @contextmanager
    def _open(self) -> Iterator[AnyReader]:
        try:
            reader = AnyReader([self._path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
            with definitions_counted():
                reader.open()
        except Exception as error:  # rosbags raises nearly anything on a damaged bag
            raise self._unreadable(error) from None
        try:
            self._check(reader)
            yield reader
        finally:
            reader.close()

    def _check(self, reader: AnyReader) -> None:
        try:
            for each in reader.readers:
                if storage := getattr(each, 'storage', None):
                    check_indexes(storage)
                else:  # a ROS 1 bag
                    limit_chunks(each, self._path)
        except OSError as error:  # a file has been removed meanwhile
            raise self._unreadable(error) from None

    def _check_definitions(self, reader: AnyReader, connections: list[Connection]) -> None:
        types = reader.typestore.fielddefs
        try:
            check_fields(types, {each.msgtype for each in connections})
        except InputError as error:
            raise self._unreadable(error) from None
        for each in connections:
            if reason := difference(types, each.msgtype, reader.is2):
                raise InputError(
                    f'{self._path}, {each.topic}: the messages are not of the type that they are '
                    f'declared as ({reason}): choose another topic, or record with the standard '
                    'definition')

    def _unreadable(self, error: Exception) -> InputError:
        return InputError(f'{self._path} cannot be read as a bag ({_reason(error)}): {_REPAIR}')


def stamp_of(message: Any) -> int:
    """Return the stamp in the header of a message [ns]."""
    return int(message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec)


def _storage(path: Path) -> Path:
    """Return the path that rosbags is to open."""
    # rosbags reads every path that ends in .bag as a ROS 1 bag
    if path.is_file() or (path / 'metadata.yaml').exists() and path.suffix != '.bag':
        return path
    files = sorted(file for file in path.iterdir() if file.suffix in ('.mcap', '.db3'))
    if len(files) == 1:
        return files[0]
    if path.suffix == '.bag':
        raise InputError(f'{path} is a folder that ends in .bag: rename it')
    raise InputError(f'{path} has {len(files)} storage files and no metadata.yaml: run `ros2 bag '
                     f'reindex {path}`, or give one of the files')


def _reason(error: Exception) -> str:
    """Return the text of an error in one line, or its type where it has none."""
    return ' '.join(str(error).split()).rstrip('.') or type(error).__name__
