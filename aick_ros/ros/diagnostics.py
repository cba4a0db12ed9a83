# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the node tells of its own health, once a second."""

from __future__ import annotations

import threading
from collections import Counter

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_msgs.msg import Header

from aick_ros.odometry import OdometryUpdate
from aick_ros.status import Status


class Diagnostics:
    """
    Counts frames by what became of them and publishes the counts on ``/diagnostics``.

    Frames may be counted on any thread.
    """

    def __init__(self, node: Node) -> None:
        self._name = f'{node.get_fully_qualified_name().lstrip("/")}: odometry'
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._status, self._reason = Status.NO_FRAME, 'waiting for images'
        self._delay_ms = 0.0
        self._timing: dict[str, float] = {}

    def count(self, event: str) -> None:
        """Count one of something, under its plain name."""
        with self._lock:
            self._counts[event] += 1

    def answered(self, update: OdometryUpdate, delay_ms: float) -> None:
        """Take note of an odometry update and the time since its images were paired."""
        with self._lock:
            self._counts['frames answered'] += 1
            self._counts['frames lost'] += not update.status.ok
            self._status, self._reason = update.status, update.reason
            self._delay_ms, self._timing = delay_ms, update.timing

    def damaged(self, reason: str) -> None:
        """Take note of a frame that could not be used."""
        with self._lock:
            self._counts['frames damaged'] += 1
            self._status, self._reason = Status.BAD_FRAME, reason

    def publish(self, node: Node, waiting_for: str, **counts: int) -> None:
        """
        Publish what was counted.

        :param waiting_for: the sentence that says what is missing, '' where nothing is.
        :param counts: further counts, by name.
        """
        with self._lock:
            values = dict(self._counts)
            values.update({name.replace('_', ' '): count for name, count in counts.items()})
            values['status'] = f'{self._status.value}: {self._reason}'
            values['delay [ms]'] = f'{self._delay_ms:.1f}'
            values.update((f'{stage} [ms]', f'{time:.2f}') for stage, time in self._timing.items())
            healthy = self._status.ok and not waiting_for
            message = waiting_for or (self._status.value if healthy else values['status'])
        self._publisher.publish(DiagnosticArray(
            header=Header(stamp=node.get_clock().now().to_msg()),
            status=[DiagnosticStatus(
                level=DiagnosticStatus.OK if healthy else DiagnosticStatus.WARN,
                name=self._name, message=message,
                values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])]))
