# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
ROS 2 bags (mcap, sqlite3) and ROS 1 bags, read message by message.

Images are paired by the stamps of their headers. An image whose stamp cannot be used is dropped
and reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory, stamp_to_seconds
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.synchronizer import Pair, Synchronizer
from aick_ros.sources import OnDamaged, SourceOptions, raise_damage
from aick_ros.sources.bag_calibration import BagCalibration
from aick_ros.sources.bag_cameras import BagCameras
from aick_ros.sources.bag_file import BagFile, stamp_of
from aick_ros.sources.bag_imu import BagImu
from aick_ros.sources.bag_stream import BagStream, StampedMessage
from aick_ros.sources.bag_topics import IMAGE, BagTopics

_QUEUE_SIZE = 64  # images of one topic that wait for a partner; chosen, bounds the memory
_SEVERAL_TYPES = 'messages of several types'


class BagSource:
    """
    A bag; see :class:`aick_ros.sources.RgbdSource`.

    :param path: folder of a ROS 2 bag, one of its .mcap or .db3 files, or a .bag file.
    :raises InputError: where the bag cannot be read, or has no images or no calibration.
    """

    def __init__(self, path: Path, options: SourceOptions = SourceOptions()) -> None:
        self.name = path.resolve().name
        self._path = path
        self._options = options
        self._bag = BagFile(path)
        topics = {topic: info for topic, info in self._bag.topics().items() if info.msgcount}
        self._topics = BagTopics({topic: str(info.msgtype or _SEVERAL_TYPES)
                                  for topic, info in topics.items()}, str(path))
        self._colour = self._topics.colour(options.colour_topic, options.depth_topic)
        self._depth = self._topics.depth(options.depth_topic, self._colour,
                                         registered=not options.register_depth)
        if self._colour == self._depth:
            raise InputError(f'{path}: the same topic is given for colour and depth, '
                             f'{self._colour}: give both, with --colour-topic and --depth-topic')
        self._length = min(topics[self._colour].msgcount, topics[self._depth].msgcount)
        self._cameras = BagCameras(self._bag, self._topics, options)
        self._first_cameras = [self._cameras.colour(self._colour), *(
            [self._cameras.depth(self._depth)] if options.register_depth else [])]
        self._remarks: Sequence[str] = ()
        self._decoder = FrameDecoder((self._colour, self._depth), '--register-depth')

    @property
    def raw_topics(self) -> tuple[str, str, str] | None:
        """
        Topics of colour, depth and calibration.

        None where one is missing or compressed, or depth is to be registered.
        """
        types = {self._topics.types[self._colour], self._topics.types[self._depth]}
        if self._options.register_depth or types != {IMAGE}:
            return None
        try:
            return (self._colour, self._depth,
                    self._topics.info(self._options.info_topic, self._colour))
        except InputError:
            return None

    @cached_property
    def ground_truth(self) -> Trajectory | None:
        """
        The poses on the topic of the ground truth, or None; null quaternions are skipped.

        :raises InputError: where the topic was asked for and has no pose.
        """
        topic = self._topics.ground_truth(self._options.ground_truth_topic)
        if topic is None:
            return None
        poses = {}
        for _, _, message in self._bag.messages([topic], raise_damage):
            with suppress(ValueError):
                poses[stamp_of(message)] = _pose(message)
        stamps = sorted(poses)
        if not stamps and self._options.ground_truth_topic is not None:
            raise InputError(f'{self._path}: {topic} has no pose that is one: its numbers are not '
                             'finite, or its quaternions are null')
        if not stamps:
            return None
        return Trajectory(np.array(stamps, np.int64),
                          np.array([poses[stamp] for stamp in stamps]))

    def __len__(self) -> int:
        """Return the number of images of the topic with fewer images."""
        return self._length

    @property
    def remarks(self) -> Sequence[str]:
        """Why the IMU is not used, and which calibration two drivers publish; a sentence each."""
        return [f'{self._path}: {sentence}' for sentence in self._remarks]

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """
        Yield the pairs of images as they are found.

        :raises InputError: where no images are near each other, the bag cannot be read to its
            end, or depth is to be registered and its extrinsic is not known.
        """
        found, imu = False, BagImu(self._topics.imu(self._colour), self._cameras.in_colour)
        calibrations = self._cameras.calibrations(self._colour, self._depth, self._first_cameras)
        seen_by: dict[int, Sequence[Camera]] = {}
        for pair in self._pairs(imu, calibrations, seen_by, on_damaged):
            found = True
            decode = self._decoder_of(pair, seen_by.pop(pair.colour_stamp))
            frame: RgbdFrame | None = None
            try:
                frame = decode(pair)
            except InputError as error:
                on_damaged(InputError(f'{self._path}, {error}'))
            else:
                frame = imu.with_samples(frame, pair.colour.header.frame_id)
            self._remarks = [*(each.remark for each in calibrations if each.remark), *imu.remarks]
            if frame is not None:
                yield frame
        if not found:
            raise InputError(
                f'{self._path}: no image on {self._colour} is within '
                f'{self._options.max_interval:g} s of one on {self._depth}: check the stamps of '
                'the two drivers')

    def _decoder_of(self, pair: Pair, cameras: Sequence[Camera]) -> Callable[[Pair], RgbdFrame]:
        """Return the function that decodes a pair; InputError where its extrinsic is missing."""
        if not self._options.register_depth:
            return partial(self._decoder.decode, camera=cameras[0])
        return partial(self._decoder.decode_and_reproject, camera=cameras[0],
                       depth_camera=cameras[1],
                       T_colour_depth=self._cameras.depth_in_colour(
                           pair.colour.header.frame_id, pair.depth.header.frame_id))

    def _pairs(self, imu: BagImu, calibrations: Sequence[BagCalibration],
               seen_by: dict[int, Sequence[Camera]], on_damaged: OnDamaged) -> Iterator[Pair]:
        """
        Yield the pairs as they are found.

        :param seen_by: gets the cameras of the moment in which a pair is found, by its stamp: it
            may wait for samples of the IMU.
        """
        def waiting(pairs: Iterable[Pair]) -> Iterator[Pair]:
            pairs = list(pairs)
            for pair in pairs:
                seen_by[pair.colour_stamp] = [each.camera for each in calibrations]
            yield from imu.wait(pairs)

        synchronizer = Synchronizer(self._options.max_interval, _QUEUE_SIZE)
        add = {self._colour: synchronizer.add_colour, self._depth: synchronizer.add_depth}
        streams = {topic: BagStream(partial(self._report, on_damaged, topic)) for topic in add}
        infos = [topic for each in calibrations for topic in each.topics]
        for topic, log_time, message in self._bag.messages(
                [*add, *imu.topics, *infos], on_damaged):
            if topic in infos:
                for each in calibrations:
                    each.take(topic, message, log_time)
                continue
            stamp = stamp_of(message)
            if topic in imu.topics:
                yield from imu.add(stamp, message)
                continue
            for image in streams[topic].add(StampedMessage(stamp, message), log_time):
                yield from waiting(add[topic](*image))
        for topic, stream in streams.items():
            for image in stream.flush():
                yield from waiting(add[topic](*image))
        yield from waiting(synchronizer.flush())
        yield from imu.flush()

    def _report(self, on_damaged: OnDamaged, topic: str, stamp: int, reason: str) -> None:
        on_damaged(InputError(f'{self._path}, {topic} at {stamp_to_seconds(stamp)}: {reason}; '
                              'the image is dropped'))


def _pose(message: Any) -> np.ndarray:
    """Return the pose in a message of a type in POSES, 4x4; ValueError where it is not a pose."""
    pose = getattr(message, 'pose', None) or message.transform
    pose = getattr(pose, 'pose', pose)
    position = pose.position if hasattr(pose, 'position') else pose.translation
    rotation = pose.orientation if hasattr(pose, 'orientation') else pose.rotation
    return se3.from_quaternion((rotation.x, rotation.y, rotation.z, rotation.w),
                               (position.x, position.y, position.z))
