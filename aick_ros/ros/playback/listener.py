# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A subscriber that records the odometry of a node."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.node import Node

from aick_ros.ros.conversions import from_pose, to_stamp
from aick_ros.ros.health.counts import Count
from aick_ros.ros.playback.answers import Answer
from aick_ros.ros.spinning import spinning

_DIAGNOSED = 'odom_node: odometry'
_UNUSABLE = (Count.DAMAGED, Count.FAILED)
_LONGEST_PAUSE = 10.0  # seconds after which no further answer is expected; chosen
_POLL = 0.005  # seconds; chosen
_QUEUE = 1000


class Listener(Node):
    """
    Records answers, and whether the node is there.

    :ivar answers: in order of arrival.
    :ivar unusable: number of frames that the node counts as damaged: they have no answer.
    :ivar heard: whether diagnostics of the node were received; its odometry will be, too.
    """

    def __init__(self) -> None:
        super().__init__('odometry_listener')
        self.answers: list[Answer] = []
        self.unusable = 0
        self.heard = False
        self.create_subscription(Odometry, 'odom', self._take, _QUEUE)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._hear, _QUEUE)

    def wait_for_answers(self, stamps: Collection[int]) -> None:
        """
        Wait until every image is answered or unusable, or the last one is answered.

        Where no answer comes for some time, none will.

        :param stamps: of the images [ns].
        """
        last = max(stamps, default=None)

        def is_complete() -> bool:
            answered = [answer.stamp for answer in self.answers[-1:]]
            return len(self.answers) + self.unusable >= len(stamps) or answered == [last]

        seen = -1
        while len(self.answers) != seen and not is_complete():
            seen = len(self.answers)
            wait_until(lambda: len(self.answers) > seen or is_complete(), _LONGEST_PAUSE)

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == _DIAGNOSED:
                counts = {each.key: each.value for each in status.values}
                self.unusable = sum(int(counts.get(count.value, 0)) for count in _UNUSABLE)
                self.heard = True

    def _take(self, message: Odometry) -> None:
        now = time.monotonic()
        twist = message.twist.twist
        self.answers.append(Answer(
            to_stamp(message.header.stamp), from_pose(message.pose.pose),
            np.reshape(message.pose.covariance, (6, 6)),
            np.array([twist.linear.x, twist.linear.y, twist.linear.z,
                      twist.angular.x, twist.angular.y, twist.angular.z]), now))


@contextmanager
def listening() -> Iterator[Listener]:
    """Record answers for the length of a block, on a thread of its own."""
    listener = Listener()
    with spinning(listener):
        yield listener


def wait_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Wait for a condition, at most ``timeout`` [s]; return whether it came true."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL)
    return True
