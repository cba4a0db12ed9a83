# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node's callbacks without DDS: images, calibrations and transforms in any order."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from targets import COLOUR_ENCODINGS, DEPTH_ENCODINGS, image_message, info_message

from aick_ros.errors import InputError
from aick_ros.odometry.base_odometry import BaseOdometry
from aick_ros.odometry.odometry import Odometry
from aick_ros.ros import conversions
from aick_ros.ros.input.assembler import FrameAssembler
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.transforms import Transforms
from aick_ros.settings.node import NodeSettings

EVENT = struct.Struct('<BiIH')
"""Kind, seconds and nanoseconds of the stamp, and bytes of an event, before these bytes."""

LINK = struct.Struct('<2B7d')
"""Numbers of parent and child, translation and quaternion of a transform."""

FRAMES = ('odom', 'base_link', 'camera', 'depth', '', '/base_link', 'head', 'odom\x1b')
COLOUR, DEPTH, INFO, DEPTH_INFO, STATIC, MOVING, FLUSH = range(7)
_MOST_EVENTS = 60


def take_events(data: bytes, _: Path) -> None:
    """Give the events that bytes stand for to the node's inputs and the odometry."""
    inputs = _Inputs(registers_depth=bool(data[:1]) and data[0] % 2 == 1)
    for kind, stamp, payload in _events(data[1:]):
        inputs.take(kind % 7, stamp, payload)


def _events(data: bytes) -> Iterator[tuple[int, Any, bytes]]:
    """Yield kind, stamp and payload of each event."""
    start = 0
    for _ in range(_MOST_EVENTS):
        if start + EVENT.size > len(data):
            return
        kind, seconds, nanoseconds, length = EVENT.unpack_from(data, start)
        start += EVENT.size
        # as a message has it: there may be more nanoseconds than a second has
        stamp = SimpleNamespace(sec=seconds, nanosec=nanoseconds)
        yield kind, stamp, data[start:start + length]
        start += length


class _Inputs:
    """The inputs of a node, and what follows them."""

    def __init__(self, registers_depth: bool) -> None:
        node: Any = _Node()
        settings = NodeSettings(register_depth=registers_depth, approx_sync_max_interval=0.02)
        transforms = Transforms(node, ('odom', 'base_link'), lambda: None)
        self._extrinsics = Extrinsics(transforms, settings)
        self._assembler = FrameAssembler(node, settings, self._extrinsics, lambda: None)
        self._pairing = Pairing(node, settings, SimpleNamespace(count=lambda count: None),
                                self._work, lambda stamp: None)
        self._odometry, self._base = Odometry(), BaseOdometry()
        self._transforms, self._callbacks = transforms, node.callbacks

    def take(self, kind: int, stamp: Any, payload: bytes) -> None:
        """Take one event, as the executor does."""
        header = SimpleNamespace(frame_id='camera', stamp=stamp)
        if kind == COLOUR:
            self._pairing.take_colour(_image(payload, COLOUR_ENCODINGS, header))
        elif kind == DEPTH:
            self._pairing.take_depth(_image(payload, DEPTH_ENCODINGS, header))
        elif kind in (INFO, DEPTH_INFO):
            message, _ = info_message(payload)
            message.header = header
            topic = '/rgb/camera_info' if kind == INFO else '/depth/camera_info'
            self._callbacks.get(topic, lambda _: None)(message)
        elif kind in (STATIC, MOVING):
            self._transforms.tend()
            topic = '/tf_static' if kind == STATIC else '/tf'
            self._callbacks.get(topic, lambda _: None)(_tf_message(payload, header.stamp))
        else:
            self._pairing.flush()

    def _work(self, pair: Any) -> None:
        """Do what the node's worker does with a pair; it logs an InputError and goes on."""
        if self._assembler.missing_for(pair):
            return
        try:
            arrival = self._assembler.arrival(pair)
            frame = self._assembler.frame(arrival)
            extrinsic = self._extrinsics.camera_in_base(arrival.camera_frame, frame.stamp,
                                                        wait=False)
            update = self._odometry.register_frame(frame)
            base = self._base.update(update, extrinsic.T_base_camera, extrinsic.mount)
        except InputError:
            return
        if base is not None:
            message = conversions.pose_with_covariance(base.stamp, 'odom', base.pose.matrix,
                                                       base.pose.covariance)
            assert np.isfinite(base.pose.matrix).all(), message
            assert not np.isnan(base.pose.covariance).any(), message


class _Node:
    """Stand-in with the methods of a node that the inputs call; its log is thrown away."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Callable[[Any], None]] = {}

    def resolve_topic_name(self, name: str) -> str:
        return f'/{name}'

    def create_subscription(self, _: Any, topic: str, callback: Callable[[Any], None],
                            qos: Any, **__: Any) -> Any:
        self.callbacks[topic] = callback
        return SimpleNamespace(topic_name=topic, qos_profile=qos)

    def destroy_subscription(self, subscription: Any) -> None:
        self.callbacks.pop(subscription.topic_name, None)

    def get_logger(self) -> Any:
        def log(text: str, **_: Any) -> None:
            assert text
        return SimpleNamespace(info=log, warning=log)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=1))


def _image(payload: bytes, encodings: tuple[str, ...], header: Any) -> Any:
    message = image_message(payload, encodings)
    message.header = header
    return message


def _tf_message(payload: bytes, stamp: Any) -> Any:
    links = []
    for start in range(0, len(payload) - LINK.size + 1, LINK.size):
        parent, child, x, y, z, *quaternion = LINK.unpack_from(payload, start)
        links.append(SimpleNamespace(
            header=SimpleNamespace(frame_id=FRAMES[parent % len(FRAMES)], stamp=stamp),
            child_frame_id=FRAMES[child % len(FRAMES)],
            transform=SimpleNamespace(
                translation=SimpleNamespace(x=x, y=y, z=z),
                rotation=SimpleNamespace(**dict(zip('xyzw', quaternion))))))
    return SimpleNamespace(transforms=links)
