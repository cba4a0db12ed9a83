# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the node tells of its own health, once a second."""

from __future__ import annotations

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_msgs.msg import Header

from aick_ros.ros.health.frame_statistics import (
    ANSWERED, LOST, RECEIVED, FrameStatistics, Snapshot)
from aick_ros.ros.health.levels import judge

_QUEUE = 10


class Diagnostics(FrameStatistics):
    """
    Counts frames by what became of them and publishes the counts on ``/diagnostics``.

    Frames may be counted on any thread.
    """

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._node = node
        self._name = f'{node.get_fully_qualified_name().lstrip("/")}: odometry'
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', _QUEUE)

    def publish(self, complaint: str, paused: bool, **present: str) -> None:
        """
        Publish what was counted.

        :param complaint: the sentence that says what is missing, '' where nothing is.
        :param present: further values, by name.
        """
        frames = self.snapshot()
        level, message = judge(frames, complaint, paused)
        values = {**_values(frames),
                  **{name.replace('_', ' '): value for name, value in present.items()}}
        self._publisher.publish(DiagnosticArray(
            header=Header(stamp=self._node.get_clock().now().to_msg()),
            status=[DiagnosticStatus(
                level=level.value, name=self._name, message=message,
                values=[KeyValue(key=key, value=value) for key, value in values.items()])]))


def _values(frames: Snapshot) -> dict[str, str]:
    values = {'status': f'{frames.status.value}: {frames.reason}',
              'input rate [Hz]': f'{frames.rate(RECEIVED):.1f}',
              'output rate [Hz]': f'{frames.rate(ANSWERED):.1f}',
              'lost share': f'{frames.share(LOST, ANSWERED):.3f}',
              'inliers': f'{frames.inliers:.0f}'}
    if len(frames.delays):
        median, worst = np.percentile(frames.delays, (50, 99))
        values.update({'delay [ms]': f'{median:.1f}', 'delay, 99 % [ms]': f'{worst:.1f}',
                       'delay since the stamp [ms]': f'{np.median(frames.ages):.1f}'})
    values.update((f'{stage} [ms]', f'{time:.2f}') for stage, time in frames.timing.items())
    values.update((name, str(total)) for name, total in frames.totals.items())
    return values
