# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Record of one frame of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.inertial.level import Turn
from aick_ros.registration.status import Status


@dataclass(frozen=True, eq=False)
class FrameRecord:
    """
    An :class:`OdometryUpdate` without images and keypoints, so that a run can keep all of them.

    :param keypoints: number of keypoints with depth.
    :param matches: number of matches.
    :param timing: stage -> milliseconds.
    """

    stamp: int
    status: Status
    reason: str
    pose: PoseWithCovariance
    keypoints: int
    matches: int
    timing: dict[str, float]
    increment: Increment | None = None
    rejected: Increment | None = None

    @property
    def T_odom_camera(self) -> np.ndarray:
        """Pose of the camera, 4x4."""
        return self.pose.matrix

    @classmethod
    def of(cls, update: OdometryUpdate) -> FrameRecord:
        """Return the record of an update."""
        return cls(
            update.stamp, update.status, update.reason, update.pose, len(update.keypoints),
            len(update.matches), update.timing, update.increment, update.rejected)

    def turned(self, turn: Turn) -> FrameRecord:
        """Return the record in a frame of the odometry that begins level."""
        return replaced(self, pose=turn.apply(self.pose))


def is_level(records: Iterable[FrameRecord]) -> bool:
    """
    Return whether z of the odometry's frame is up, by an accelerometer.

    Otherwise the frame is that of the camera at the start: the first tracked pose is the identity,
    which no level pose is.
    """
    first = next((record for record in records if record.status.ok), None)
    return first is not None and not np.allclose(first.pose.rotation, np.eye(3))


def stages_of(records: Iterable[FrameRecord]) -> list[str]:
    """Return the stages of the odometry that were timed, in their order, ``total`` last."""
    stages = dict.fromkeys(stage for record in records for stage in record.timing)
    return sorted(stages, key=lambda stage: stage == 'total')


def trajectory_of(records: Sequence[FrameRecord]) -> Trajectory:
    """Return the trajectory of a run; lost frames have the pose that was held or predicted."""
    poses = np.array([record.T_odom_camera for record in records]).reshape(-1, 4, 4)
    return Trajectory(np.array([record.stamp for record in records], np.int64), poses)
