# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Missing, late and dropped input: in the log, and on /diagnostics."""

from __future__ import annotations

from rclpy.node import Node

from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.health.expectations import Expectations
from aick_ros.ros.health.sentences import joined
from aick_ros.ros.image_stream import ImageStream
from aick_ros.ros.input.assembler import Arrival
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.load_control import LoadControl
from aick_ros.ros.robot_odometry import RobotOdometry
from aick_ros.ros.work_queue import WorkQueue
from aick_ros.settings import NodeSettings

_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen


class Report:
    """Reports the state of all parts of the node, once a second."""

    def __init__(self, node: Node, settings: NodeSettings, diagnostics: Diagnostics,
                 transforms: Transforms, queue: WorkQueue[Arrival], odometry: RobotOdometry,
                 load: LoadControl) -> None:
        self._logger, self._diagnostics = node.get_logger(), diagnostics
        self._expectations = Expectations(node, settings)
        self._transforms, self._queue = transforms, queue
        self._odometry, self._load = odometry, load

    def publish(self, images: ImageStream, dropped: int, paused: bool) -> None:
        """
        Log and publish the state.

        :param dropped: number of frames dropped for newer ones.
        :param paused: whether frames are skipped by request.
        """
        complaint = joined(
            images.complaint(), self._expectations.complaint(), self._odometry.complaint)
        self._expectations.report_differences()
        if complaint:
            self._logger.warning(complaint, throttle_duration_sec=_THROTTLE)
        for count, total in images.counts.items():
            self._diagnostics.count_up_to(count, total)
        late = self._transforms.complaint
        self._diagnostics.dropped(dropped, while_waiting=bool(late))
        concern = joined(late, self._odometry.concern)
        if concern:  # from a line of its own, for which the log counts the seconds
            self._logger.warning(concern, throttle_duration_sec=_THROTTLE)
        self._diagnostics.publish(
            complaint, paused,
            {'backlog': str(self._queue.backlog),
             'backlog in MB': f'{self._queue.backlog_bytes / 1e6:.1f}',
             **self._odometry.findings,
             'dropped to shed load': self._load.dropped},
            joined(concern, self._load.sentence))
