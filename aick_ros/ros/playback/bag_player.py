# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Player of ROS 2 bags over DDS, in place of a camera."""

from __future__ import annotations

import argparse
import os
import re
import struct
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn, TypeVar

from rclpy.duration import Duration
from rclpy.exceptions import NameValidationException
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import remove_ros_args
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock

from aick_ros.borders.bag_limits import check_indexes
from aick_ros.borders.bag_reading import prepare_to_read
from aick_ros.borders.names import one_line
from aick_ros.errors import InputError
from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS
from aick_ros.ros.conversions import to_time
from aick_ros.ros.playback.pace import RealTime, StepByStep
from aick_ros.ros.process.program import RCLError, make_node, program
from aick_ros.ros.process.resources import use_fastdds_profile
from aick_ros.ros.process.signals import held
from aick_ros.ros.typed_topics import TypedTopics

_IMAGE = 'sensor_msgs/msg/Image'
_CLOCK = '/clock'
_QUEUE = 10
_ACKNOWLEDGED_WITHIN = Duration(seconds=2)
_MESSAGE_TYPE = re.compile(r'(\w+)/msg/(\w+)', re.ASCII)
_STAMP_END = 12  # bytes; by definition of CDR: four of its own, seconds and nanoseconds
_SLOWEST = 0.001  # playback rate; chosen

_Item = TypeVar('_Item')


@dataclass(frozen=True)
class Played:
    """
    A message that was published.

    :param topic: its name in the bag.
    :param stamp: stamp of its header [ns]; None unless it is an image.
    :param published_at: monotonic time [s].
    """

    topic: str
    stamp: int | None
    published_at: float


class BagPlayer(TypedTopics):
    """
    Publishes the messages of a bag, byte for byte, as they were recorded.

    :param path: folder of a ROS 2 bag.
    :param arguments: arguments of this node beside those of the process, ``--ros-args -r a:=b``.
    :raises InputError: where the bag cannot be read or has nothing to play.
    """

    def __init__(self, path: Path, arguments: Sequence[str] = ()) -> None:
        super().__init__('bag_player', cli_args=list(arguments))
        self._path = path
        self._clock_publisher = self.create_publisher(Clock, _CLOCK, 10)
        self._publishers_by_topic = self._advertise()

    @property
    def topics(self) -> list[str]:
        """Topics that are played."""
        return list(self._publishers_by_topic)

    def has_subscribers(self, topics: Iterable[str]) -> bool:
        """Return whether each of the topics has a subscriber."""
        return all(self._publishers_by_topic[topic].get_subscription_count() for topic in topics)

    def play(self, pace: Callable[[int], None]) -> Iterator[Played]:
        """
        Publish message after message.

        :param pace: called with each message's time of recording [ns]; returns when it is due.
        :raises InputError: where the bag breaks off.
        """
        with _reading(self._path) as reader:
            connections = [connection for connection in reader.connections
                           if connection.topic in self._publishers_by_topic]
            for connection, stamp, message in _readable(self._path, reader.messages(connections)):
                if not 0 <= stamp <= MAX_STAMP:
                    raise InputError(f'{self._path}: a message on {connection.topic} was recorded '
                                     f'at {stamp} ns, which is no time of ROS: record it again')
                pace(stamp)
                self._clock_publisher.publish(Clock(clock=to_time(stamp)))
                self._publishers_by_topic[connection.topic].publish(bytes(message))
                image = connection.msgtype == _IMAGE
                yield Played(connection.topic, _header_stamp(message) if image else None,
                             time.monotonic())
        for publisher in self._publishers_by_topic.values():
            publisher.wait_for_all_acked(_ACKNOWLEDGED_WITHIN)

    def _advertise(self) -> dict[str, Publisher]:
        publishers = {}
        with _reading(self._path) as reader:
            for connection in reader.connections:
                topic, kind = connection.topic, _message_class(connection.msgtype)
                if topic == _CLOCK:
                    continue  # the time is that of this playing
                if kind is None:
                    self.get_logger().warning(one_line(
                        f'{topic} is not played: {connection.msgtype} is not installed'))
                elif topic not in publishers:
                    try:
                        publishers[topic] = self.create_publisher(kind, topic, _qos(topic))
                    except (ValueError, RCLError, NameValidationException) as error:
                        self.get_logger().warning(one_line(f'{topic} is not played: {error}'))
        if not publishers:
            raise InputError(f'{self._path} has no topic whose message type is installed')
        return publishers


@contextmanager
def _reading(path: Path) -> Iterator[Reader]:
    if not os.path.exists(path):  # where the name is too long, Path would raise
        raise InputError(f'cannot play {path}: it does not exist; the folder of a ROS 2 bag is '
                         'required')
    prepare_to_read(path)
    try:
        reader = Reader(path)
        reader.open()
    except Exception as error:  # rosbags raises nearly anything on a damaged bag
        raise _unplayable(path, error) from None
    try:
        check_indexes(reader.storage)
        for connection in reader.connections:
            for name in (connection.topic, connection.msgtype):
                if not isinstance(name, str):  # any YAML may be in its metadata
                    raise InputError(f'cannot play {path}: {name} is no name of a topic or of a '
                                     'message type; record the bag again')
        yield reader
    finally:
        reader.close()


def _readable(path: Path, items: Iterator[_Item]) -> Iterator[_Item]:
    """Yield the items; InputError where the bag cannot be read on."""
    while True:
        try:
            item = next(items)
        except StopIteration:
            return
        except Exception as error:  # as above
            raise _unplayable(path, error) from None
        yield item


def _unplayable(path: Path, error: Exception) -> InputError:
    return InputError(f'cannot play {path}: {error}; the folder of a ROS 2 bag is required (aick '
                      'convert makes one of other recordings)')


def _header_stamp(message: bytes) -> int | None:
    """Return the stamp [ns] of a serialized message that begins with a header, if it has one."""
    if len(message) < _STAMP_END:
        return None
    little_endian = message[1] & 1
    seconds: int
    nanoseconds: int
    seconds, nanoseconds = struct.unpack_from('<iI' if little_endian else '>iI', message, 4)
    return seconds * NANOSECONDS + nanoseconds


def _message_class(name: str) -> type | None:
    """Return the class of a message type, None where it is not installed."""
    parts = _MESSAGE_TYPE.fullmatch(name)
    package = parts and find_spec(parts[1])
    places = package and package.submodule_search_locations
    if not parts or not any(Path(place, 'msg').is_dir() for place in places or ()):
        return None  # the import of any other module may do anything
    try:
        found: type = getattr(import_module(f'{parts[1]}.msg'), parts[2])
    except (ImportError, AttributeError):
        return None
    return found


def _qos(topic: str) -> QoSProfile:
    """Return a reliable QoS, which matches every subscriber; latched where TF expects that."""
    latched = topic == '/tf_static'
    return QoSProfile(
        depth=_QUEUE, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


class _Parser(argparse.ArgumentParser):
    """A parser that rejects arguments in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'{self.prog}: {one_line(message)}; see {self.prog} --help\n')


def _arguments() -> argparse.Namespace:
    parser = _Parser(
        prog='bag_player', description='Play a ROS 2 bag over DDS with /clock. Topics are '
        'remapped by --ros-args -r /camera/rgb/image_raw:=/rgb/image')
    # ~ is not filled in by the shell in bag:=~/bag of a launch file
    parser.add_argument('bag', type=lambda name: Path(os.path.expanduser(name)),
                        help='folder of a ROS 2 bag')
    parser.add_argument('--rate', type=float, default=1.0, help='playback rate (default 1)')
    parser.add_argument('--step', action='store_true', help='play one frame per Enter')
    parser.add_argument('--wait', type=float, default=10.0, metavar='S', help='longest '
                        'wait for subscribers of the images [s] (default 10)')
    try:
        own = remove_ros_args(sys.argv)[1:]
    except Exception as error:  # rcl's errors have no common base class
        parser.error(str(error))
    arguments = parser.parse_args(own)
    if not arguments.rate >= _SLOWEST:
        parser.error(f'--rate is {arguments.rate:g}: a number of at least {_SLOWEST:g} is '
                     'required')
    if not arguments.wait >= 0:
        parser.error(f'--wait is {arguments.wait:g}: a number of at least 0 is required')
    return arguments


def main() -> None:
    """Play the bag named on the command line."""
    arguments = _arguments()
    with (program('bag_player', use_fastdds_profile, interrupt=True),
          suppress(EOFError)):  # the end of the input to --step
        with held():  # rclpy complains where the context ends while it makes the node
            player = make_node(lambda: BagPlayer(arguments.bag))
        _play(player, arguments)


def _play(player: BagPlayer, arguments: argparse.Namespace) -> None:
    images = [topic for topic in player.topics if 'image' in topic]
    deadline = time.monotonic() + arguments.wait
    while not player.has_subscribers(images):
        if time.monotonic() > deadline:
            player.get_logger().warning(
                f'not all of {", ".join(images)} have a subscriber: remap them to the topics of '
                'the node')
            break
        time.sleep(0.01)
    pace = StepByStep() if arguments.step else RealTime(arguments.rate)
    count = sum(1 for _ in player.play(pace))
    player.get_logger().info(f'played {count} messages of {arguments.bag}')


if __name__ == '__main__':
    main()
