# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A subscriber to all that the odometry node publishes for people."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Protocol

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry, Path
from rclpy.exceptions import InvalidNamespaceException
from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace
from sensor_msgs.msg import Image, PointCloud2

from aick_ros.errors import InputError
from aick_ros.messages.raw_image import decode_colour
from aick_ros.ros.conversions import UNKNOWN, from_pose, to_stamp
from aick_ros.ros.health.diagnostics import STATUS
from aick_ros.ros.output.views import POINT_STEP, positions_of
from aick_ros.ros.process.program import initialise, make_node
from aick_ros.ros.process.resources import use_fastdds_profile
from aick_ros.ros.spinning import spinning

_NEWEST, _EVERY = 1, 1000  # messages in a queue
_NUMBER = re.compile(r'-?\d+(\.\d*)?')


class Observer(Protocol):
    """Whom a watcher reports to, on its own thread."""

    def add_pose(self, stamp: int, T_odom_base: np.ndarray, covariance: np.ndarray) -> None:
        """Take the pose of a frame, its 6x6 covariance infinite while and after it was lost."""

    def add_lost(self, stamp: int) -> None:
        """Take the stamp of a frame without a pose."""

    def add_path(self, positions: np.ndarray) -> None:
        """Take the path up to now, Nx3."""

    def add_image(self, stamp: int, colour: np.ndarray) -> None:
        """Take the image with its keypoints and matches, HxWx3 uint8."""

    def add_keypoints(self, stamp: int, positions: np.ndarray) -> None:
        """Take the keypoints of a frame in the odometry's frame, Nx3."""

    def add_health(self, message: str, numbers: Mapping[str, float]) -> None:
        """Take the sentence and the numbers of the diagnostics."""


class Watcher(Node):
    """
    Subscribes to odom, path, debug_image, keypoints and the diagnostics.

    The path is taken once: what comes later is in odom.

    :ivar hears: whether diagnostics of the node have come; all else will, too.
    :ivar frames: number of messages of odom.
    :ivar topic: name of odom in the graph.
    :param namespace: of the odometry node.
    """

    def __init__(self, observer: Observer, namespace: str) -> None:
        super().__init__('aick_view', namespace=namespace)
        self._observer, self.frames, self.hears = observer, 0, False
        self._prefix = namespace.strip('/')
        self.topic = self.create_subscription(
            Odometry, 'odom', self._take_odom, _EVERY).topic_name
        self.create_subscription(Image, 'debug_image', self._take_image, _NEWEST)
        self.create_subscription(PointCloud2, 'keypoints', self._take_keypoints, _NEWEST)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, _EVERY)
        self._path = self.create_subscription(Path, 'path', self._take_path, _NEWEST)
        self._has_path = False

    @property
    def is_alone(self) -> bool:
        """No node publishes odom any more, though one has."""
        return self.hears and not self.count_publishers(self.topic)

    def _take_odom(self, message: Odometry) -> None:
        stamp = to_stamp(message.header.stamp)
        self.frames += 1
        covariance = np.reshape(message.pose.covariance, (6, 6))
        is_known = covariance[0, 0] < UNKNOWN[0, 0]
        try:
            self._observer.add_pose(stamp, from_pose(message.pose.pose),
                                    covariance if is_known else np.full((6, 6), np.inf))
        except ValueError:  # the quaternion of zeros of a lost camera
            self._observer.add_lost(stamp)

    def _take_path(self, message: Path) -> None:
        if not self._has_path:
            self._has_path = True
            self._observer.add_path(np.array([
                [pose.pose.position.x, pose.pose.position.y, pose.pose.position.z]
                for pose in message.poses]).reshape(-1, 3))
            self.destroy_subscription(self._path)

    def _take_image(self, message: Image) -> None:
        try:
            colour = decode_colour(message)
        except InputError:
            return  # of another program: the odometry's are rgb8
        self._observer.add_image(to_stamp(message.header.stamp), colour)

    def _take_keypoints(self, message: PointCloud2) -> None:
        if message.point_step == POINT_STEP and len(message.data) % POINT_STEP == 0:
            self._observer.add_keypoints(to_stamp(message.header.stamp), positions_of(message))

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            node = status.name.removesuffix(STATUS)
            if node != status.name and node.rpartition('/')[0] == self._prefix:
                self.hears = True
                self._observer.add_health(status.message, {
                    pair.key: float(pair.value) for pair in status.values
                    if _NUMBER.fullmatch(pair.value)})


def check_namespace(namespace: str) -> None:
    """
    Check the namespace of a node.

    :raises InputError: where it is not valid.
    """
    if not namespace.isascii():  # rclpy checks the others
        raise InputError(f'--namespace {namespace}: letters, digits, _ and / are required')
    try:
        validate_namespace(f'/{namespace.lstrip("/")}')
    except InvalidNamespaceException as error:
        reason = str(error).splitlines()[0].rstrip(':')
        raise InputError(f'--namespace {namespace}: {reason}') from None


@contextmanager
def watching(observer: Observer, namespace: str, remaps: Sequence[str] = ()
             ) -> Iterator[tuple[Watcher, Future[None]]]:
    """
    Report what a node publishes, for the length of a block.

    :param namespace: a valid one.
    :param remaps: rules for the names of topics, as ROS has them: ``odom:=camera/odom``.
    :returns: the subscriber, and a future that is done as soon as the observer fails, whose error
        is raised after the block.
    :raises InputError: where ROS cannot start.
    """
    use_fastdds_profile()
    arguments = [argument for rule in remaps for argument in ('--remap', rule)]
    initialise(['--ros-args', *arguments] if arguments else [], ends_by_signals=False)
    try:
        watcher = make_node(lambda: Watcher(observer, namespace))
        with spinning(watcher) as spin:
            yield watcher, spin
    finally:
        rclpy.try_shutdown()
