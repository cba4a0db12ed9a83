# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is kept of each frame of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.status import Status


@dataclass(frozen=True, eq=False)
class FrameRecord:
    """
    An :class:`OdometryUpdate` without its keypoints, small enough to keep one for each frame.

    :param keypoints: their number; matches likewise.
    :param covariance: 6x6 of the pose [m^2, m rad, rad^2].
    :param increment: 4x4, None where the frame was not registered.
    :param increment_covariance: 6x6.
    :param timing: stage -> milliseconds.
    :param interval: time of the increment [s]; 0 where there is none.
    :param refused: 4x4, the increment that was not believed; None where there is none.
    :param refused_interval: its time [s].
    """

    stamp: int
    status: Status
    reason: str
    T_odom_camera: np.ndarray
    covariance: np.ndarray
    keypoints: int
    matches: int
    increment: np.ndarray | None
    increment_covariance: np.ndarray
    timing: dict[str, float]
    interval: float = 0.0
    refused: np.ndarray | None = None
    refused_interval: float = 0.0

    @classmethod
    def of(cls, update: OdometryUpdate) -> FrameRecord:
        """Return what is kept of an update."""
        return cls(
            update.stamp, update.status, update.reason, update.T_odom_camera,
            update.covariance, len(update.keypoints), len(update.matches),
            update.increment if update.interval > 0 else None, update.increment_covariance,
            update.timing, update.interval, update.refused, update.refused_interval)


def stages_of(records: Iterable[FrameRecord]) -> list[str]:
    """Return the stages that took time in some frames, in their order, ``total`` last."""
    stages = dict.fromkeys(stage for record in records for stage in record.timing)
    return sorted(stages, key=lambda stage: stage == 'total')


def trajectory_of(records: Sequence[FrameRecord]) -> Trajectory:
    """
    Return the path of a run.

    Lost frames are in it with the pose that was held.
    """
    poses = np.array([record.T_odom_camera for record in records]).reshape(-1, 4, 4)
    return Trajectory(np.array([record.stamp for record in records], np.int64), poses)
