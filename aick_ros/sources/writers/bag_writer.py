# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS 2 bags, as if a camera driver and a motion capture system had been recorded."""

from __future__ import annotations

import heapq
from itertools import count
from pathlib import Path
from typing import Any, Literal

from rosbags.rosbag2 import StoragePlugin, Writer

from aick_ros.borders.bag_names import escape_names
from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.messages.raw_image import encode_colour, encode_depth
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage
from aick_ros.sources.writers import Progress, bag_messages, no_progress
from aick_ros.sources.writers.new_folder import new_folder

COLOUR_TOPIC = '/camera/rgb/image_raw'
DEPTH_TOPIC = '/camera/depth/image_raw'
INFO_TOPIC = '/camera/rgb/camera_info'
GROUND_TRUTH_TOPIC = '/ground_truth'
IMU_TOPIC = '/camera/imu'

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}

_BAG_VERSION: Literal[9] = 9  # of ROS 2 Jazzy


def write_bag(path: Path, source: RgbdSource, storage: str = 'mcap',
              depth_encoding: str = '32FC1', on_damaged: OnDamaged = raise_damage,
              progress: Progress = no_progress) -> int:
    """
    Write a recording as a ROS 2 bag.

    Images and camera_info have the stamps of the frames, samples of an IMU and the ground truth
    their own. Messages are in
    the order of their stamps, which are also their log times.

    :param path: the new folder; it appears once it is complete.
    :param storage: a key of :data:`STORAGES`.
    :param depth_encoding: ``32FC1`` keeps the depth bit for bit, so that odometry over the bag
        equals odometry over the source; ``16UC1`` has half the size and rounds to millimetres.
    :returns: the number of frames written.
    :raises InputError: where ``path`` exists, cannot be written, or there are no frames.
    """
    if storage not in STORAGES:
        raise InputError(f'there is no bag storage {storage!r}: use one of {", ".join(STORAGES)}')
    escape_names()
    written = 0
    with new_folder(path) as folder, Writer(
            folder, version=_BAG_VERSION, storage_plugin=STORAGES[storage]) as writer:
        bag = _OrderedBag(writer)
        if source.ground_truth is not None:
            bag.add_ground_truth(source.ground_truth)
        for written, frame in enumerate(source.frames(on_damaged), 1):
            bag.add_frame(frame, depth_encoding)
            progress(written, len(source))
        if not written:
            raise InputError(f'{source.name} has no frames to write')
        bag.write_rest()
    return written


class _OrderedBag:
    """Delays messages until no message with an earlier stamp can come."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._connections: dict[str, Any] = {}
        self._waiting: list[tuple[int, int, str, Any]] = []
        self._number = count()

    def add_ground_truth(self, trajectory: Trajectory) -> None:
        for stamp, pose in zip(trajectory.stamps, trajectory.poses):
            self._add(int(stamp), GROUND_TRUTH_TOPIC, bag_messages.pose(int(stamp), pose))

    def add_frame(self, frame: RgbdFrame, depth_encoding: str) -> None:
        depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
        if frame.imu is not None:
            self._add_imu(frame.imu)
        self._add(frame.stamp, INFO_TOPIC, bag_messages.camera_info(frame.stamp, frame.camera))
        self._add(frame.stamp, COLOUR_TOPIC,
                  bag_messages.image(frame.stamp, encode_colour(frame.colour)))
        self._add(depth_stamp, DEPTH_TOPIC,
                  bag_messages.image(depth_stamp, encode_depth(frame.depth, depth_encoding)))
        # stamps of colour and of depth increase, so nothing earlier than these two will come
        self._write_until(min(frame.stamp, depth_stamp))

    def _add_imu(self, samples: ImuSamples) -> None:
        for stamp, rate, acceleration in zip(samples.stamps.tolist(), samples.turn_rates,
                                             samples.accelerations):
            self._add(stamp, IMU_TOPIC, bag_messages.imu(stamp, rate, acceleration))

    def write_rest(self) -> None:
        if self._waiting:
            self._write_until(max(stamp for stamp, *_ in self._waiting))

    def _add(self, stamp: int, topic: str, message: Any) -> None:
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, message.__msgtype__, typestore=bag_messages.TYPESTORE)
        heapq.heappush(self._waiting, (stamp, next(self._number), topic, message))

    def _write_until(self, end: int) -> None:
        while self._waiting and self._waiting[0][0] <= end:
            stamp, _, topic, message = heapq.heappop(self._waiting)
            self._writer.write(self._connections[topic], stamp, bag_messages.TYPESTORE
                               .serialize_cdr(message, message.__msgtype__))
