# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs the real node on a bag: starts it, plays the bag to it over DDS, records its answers."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from aick_ros.errors import InputError
from aick_ros.ros.conversions import UNKNOWN, from_pose, to_stamp
from aick_ros.ros.playback.bag_player import BagPlayer
from aick_ros.ros.process.resources import use_fastdds_profile

DIAGNOSED = 'odom_node: odometry'
NODE_COMMAND = (sys.executable, '-c',
                'from aick_ros.ros.process.entry_points import odom_node; odom_node()')

_DISCOVERY = 10.0  # seconds; it takes 0.1 to 3
_PATIENCE = 3.0  # seconds without an answer after which none is expected
_QUEUE = 1000


@dataclass(frozen=True, eq=False)
class Answer:
    """
    One odometry message.

    :param stamp: of the image it answers [ns].
    :param T_odom_base: 4x4.
    :param covariance: 6x6 of the pose, as sent.
    :param twist: (vx, vy, vz, wx, wy, wz) in the base frame.
    :param received_at: by the monotonic clock [s].
    """

    stamp: int
    T_odom_base: np.ndarray
    covariance: np.ndarray
    twist: np.ndarray
    received_at: float

    @property
    def tracked(self) -> bool:
        """Whether the node vouches for the pose."""
        return bool(self.covariance[0, 0] < UNKNOWN[0, 0])


@dataclass
class LiveRun:
    """
    What was played and what came back.

    :param published_at: stamp of each colour image [ns] -> when it was published [s, monotonic].
    :param answers: in the order of their arrival, each to one of these images.
    """

    published_at: dict[int, float] = field(default_factory=dict)
    answers: list[Answer] = field(default_factory=list)

    @property
    def delays(self) -> np.ndarray:
        """From the publishing of the colour image to the receipt of the odometry [s]."""
        return np.array([answer.received_at - self.published_at[answer.stamp]
                         for answer in self.answers])

    @property
    def rate(self) -> float:
        """Answers a second; 0 where there are fewer than two."""
        if len(self.answers) < 2:
            return 0.0
        span = self.answers[-1].received_at - self.answers[0].received_at
        return (len(self.answers) - 1) / span


def run_live(bag: Path, remappings: Mapping[str, str], parameters: Mapping[str, Any],
             pace: Callable[[int], None], command: Sequence[str] = NODE_COMMAND,
             on_progress: Callable[[int], None] = lambda played: None) -> LiveRun:
    """
    Play a bag to the node in a process of its own and return its answers.

    :param remappings: the node's names ``rgb/image``, ``depth/image``, ``rgb/camera_info`` ->
        the bag's topics.
    :param parameters: of the node.
    :param pace: as :meth:`BagPlayer.play` takes it.
    :param command: that starts the node.
    :param on_progress: called with the number of colour images played.
    :raises InputError: where the bag cannot be played or the node does not start.
    """
    use_fastdds_profile()
    rclpy.init(args=[])
    try:
        with _node_process(command, remappings, parameters) as process, _listening() as listener:
            _play(bag, remappings, pace, process, listener, on_progress)
            return listener.run_of_what_was_played()
    finally:
        rclpy.try_shutdown()


def _play(bag: Path, remappings: Mapping[str, str], pace: Callable[[int], None],
          process: subprocess.Popen, listener: _Listener,
          on_progress: Callable[[int], None]) -> None:
    player = BagPlayer(bag)
    missing = sorted(set(remappings.values()) - set(player.topics))
    if missing:
        raise InputError(f'{bag} has no topic {", ".join(missing)}')
    topics = list(remappings.values())
    _wait_until(lambda: process.poll() is not None or (
        player.has_subscribers(topics) and listener.heard), _DISCOVERY)
    if process.poll() is not None:
        raise InputError(f'odom_node ended at once with exit code {process.poll()}')
    if not (player.has_subscribers(topics) and listener.heard):
        raise InputError(f'odom_node did not come up within {_DISCOVERY:g} s')
    for played in player.play(pace):
        if played.topic == remappings['rgb/image']:
            listener.run.published_at[played.stamp] = played.published_at
            on_progress(len(listener.run.published_at))
    listener.wait_for_answers(len(listener.run.published_at))


class _Listener(Node):
    """Records the odometry and notices when the node is there."""

    def __init__(self) -> None:
        super().__init__('odometry_listener')
        self.run = LiveRun()
        self._heard = False
        self.create_subscription(Odometry, 'odom', self._take, _QUEUE)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._hear, _QUEUE)

    def run_of_what_was_played(self) -> LiveRun:
        """Return the run without what others publish under the same name."""
        return LiveRun(self.run.published_at, [
            answer for answer in self.run.answers if answer.stamp in self.run.published_at])

    @property
    def heard(self) -> bool:
        """Whether the node gave a sign of life: what reaches us then, its odometry will too."""
        return self._heard

    def wait_for_answers(self, count: int) -> None:
        """Wait for so many answers, or until no more come."""
        seen = -1
        while len(self.run.answers) not in (seen, count):
            seen = len(self.run.answers)
            _wait_until(lambda: len(self.run.answers) > seen, _PATIENCE)

    def _hear(self, message: DiagnosticArray) -> None:
        self._heard |= any(status.name == DIAGNOSED for status in message.status)

    def _take(self, message: Odometry) -> None:
        now = time.monotonic()
        twist = message.twist.twist
        self.run.answers.append(Answer(
            to_stamp(message.header.stamp), from_pose(message.pose.pose),
            np.reshape(message.pose.covariance, (6, 6)),
            np.array([twist.linear.x, twist.linear.y, twist.linear.z,
                      twist.angular.x, twist.angular.y, twist.angular.z]), now))


@contextmanager
def _listening() -> Iterator[_Listener]:
    listener = _Listener()
    executor = SingleThreadedExecutor()
    executor.add_node(listener)
    thread = threading.Thread(target=_spin, args=(executor,), daemon=True)
    thread.start()
    try:
        yield listener
    finally:
        executor.shutdown()
        thread.join()
        listener.destroy_node()


def _spin(executor: SingleThreadedExecutor) -> None:
    try:
        executor.spin()
    except ExternalShutdownException:
        pass


@contextmanager
def _node_process(command: Sequence[str], remappings: Mapping[str, str],
                  parameters: Mapping[str, Any]) -> Iterator[subprocess.Popen]:
    arguments = ['--ros-args']
    for name, topic in remappings.items():
        arguments += ['-r', f'{name}:={topic}']
    for name, value in parameters.items():
        arguments += ['-p', f'{name}:={_yaml(value)}']
    process = subprocess.Popen([*command, *arguments])
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _yaml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, (tuple, list)) else str(value)


def _wait_until(condition: Callable[[], Any], timeout: float) -> bool:
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True
