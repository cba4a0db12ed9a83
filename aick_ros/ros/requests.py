# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Requests to the odometry, and the frames that are discarded for them."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.ros.control import Control
from aick_ros.ros.cutoff import Cutoff
from aick_ros.ros.health.counts import Count
from aick_ros.ros.output.outputs import Outputs
from aick_ros.ros.robot_odometry import RobotOdometry

_THROTTLE = 1.0  # seconds between two log lines of poses that are set; chosen


class Requests:
    """
    Resets the odometry, and places it, between two frames; pauses it at once.

    :param odom_frame: the only frame in which a pose can be set.
    :param between_frames: called with a task that the worker is to do between two frames.
    :param is_active: returns whether images are taken.
    """

    def __init__(self, node: Node, odom_frame: str, odometry: RobotOdometry, outputs: Outputs,
                 between_frames: Callable[[Callable[[], None]], None],
                 is_active: Callable[[], bool]) -> None:
        self._logger = node.get_logger()
        self._odometry, self._outputs = odometry, outputs
        self._between_frames, self._is_active = between_frames, is_active
        self._cutoff = Cutoff()
        self._control = Control(node, odom_frame, self._reset, self._pause, self._set_pose)

    @property
    def paused(self) -> bool:
        """State in which frames are skipped."""
        return self._control.paused

    def discarded_as(self, paired_at: float) -> Count | None:
        """
        Return what a frame before the last pause or reset is counted as; None: it is answered.

        :param paired_at: steady time [s].
        """
        return self._cutoff.count_of(paired_at)

    def _pause(self) -> None:
        self._cutoff.set(Count.SKIPPED_WHILE_PAUSED)

    def _reset(self, pose: PoseWithCovariance | None) -> None:
        self._cutoff.set(Count.DROPPED_BY_RESET)

        def reset() -> None:
            self._odometry.reset(pose)
            self._outputs.reset()
            self._logger.info('odometry reset')
        self._between_frames(reset)

    def _set_pose(self, pose: PoseWithCovariance, paused: bool) -> None:
        is_blind = paused or not self._is_active()

        def set_pose() -> None:
            self._odometry.set_pose(pose, is_blind)
            self._outputs.place_anew()
            self._logger.info('pose set', throttle_duration_sec=_THROTTLE)
        self._between_frames(set_pose)
