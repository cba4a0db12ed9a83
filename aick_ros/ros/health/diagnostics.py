# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The report of the node's health on ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_msgs.msg import Header

from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.frame_statistics import FrameStatistics, Snapshot
from aick_ros.ros.health.levels import judge

STATUS = ': odometry'
"""End of the name of the status, behind that of the node."""

_QUEUE = 10
_LONGEST_AGE = 3.6e6  # ms; chosen: a stamp older than an hour is not of this clock


class Diagnostics(FrameStatistics):
    """Counts frames by outcome, on any thread, and publishes the counts on ``/diagnostics``."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._node = node
        self._name = f'{node.get_fully_qualified_name().lstrip("/")}{STATUS}'
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', _QUEUE)

    def publish(self, complaint: str, paused: bool, present: Mapping[str, str],
                concern: str = '') -> None:
        """
        Publish level, sentence, counts and times.

        :param complaint: what is missing at the inputs, '' where nothing is.
        :param paused: whether frames are skipped by request.
        :param present: further values by key.
        :param concern: what the counts do not show, '' for nothing.
        """
        frames = self.snapshot()
        level, message = judge(frames, complaint, paused, concern)
        self._publisher.publish(DiagnosticArray(
            header=Header(stamp=self._node.get_clock().now().to_msg()),
            status=[DiagnosticStatus(
                level=level.value, name=self._name, message=message,
                values=[KeyValue(key=key, value=value)
                        for key, value in {**values_of(frames), **present}.items()])]))


def values_of(frames: Snapshot) -> dict[str, str]:
    """Return counts and times as text, by key."""
    values = {'status': f'{frames.status.value}: {frames.reason}',
              'input rate [Hz]': f'{frames.rate(Count.RECEIVED):.1f}',
              'output rate [Hz]': f'{frames.rate(Count.ANSWERED):.1f}',
              'lost share': f'{frames.share(Count.LOST, Count.ANSWERED):.3f}',
              'inliers': f'{frames.inliers:.0f}'}
    if len(frames.delays):
        median, worst = np.percentile(frames.delays, (50, 99))
        values.update({'delay [ms]': f'{median:.1f}', 'delay, 99 % [ms]': f'{worst:.1f}',
                       'delay since the stamp [ms]': _age(float(np.median(frames.ages)))})
    values.update((f'{stage} [ms]', f'{time:.2f}') for stage, time in frames.timing.items())
    values.update((count.value, str(total)) for count, total in frames.totals.items())
    return values


def _age(age: float) -> str:
    if abs(age) > _LONGEST_AGE:
        return 'unknown: the stamps are of another clock; with a bag, set use_sim_time'
    return f'{age:.1f}'
