# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Result of the odometry for one frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.odometry.inertial.level import Turn
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status


@dataclass(frozen=True, eq=False)
class OdometryUpdate:
    """
    Pose and motion of the camera at one frame.

    :param stamp: stamp of the frame [ns].
    :param status: OK or FIRST_FRAME, or why the pose was not measured; ``reason`` has the numbers.
    :param pose: ``T_odom_camera``, its covariance accumulated since the start. Where the frame
        was lost, or repeats, it is predicted or held at constant velocity.
    :param prepared: the frame as it is registered.
    :param increment: motion over its ``interval`` up to the frame: since the last tracked frame
        or, where it was registered to an earlier one, as after a loss, since that; None where
        nothing was measured.
    :param expected: motion since the last tracked frame by the motion model or another sensor,
        where the images repeat those of the frame before; None otherwise.
    :param rejected: the motion that was measured but failed a check; None where there is none.
    :param recovered: whether this is the first tracked frame after a loss or a restart.
    :param predicted: whether the pose of a lost frame is that of the predicted motion.
    :param reference: keypoints of the frame it was registered to; None without an increment.
    :param matches: Kx2, rows (keypoint, keypoint of the reference).
    :param support: number of keypoints that agree with the increment; 0 without one.
    :param evidence: what supports the increment; None without one.
    :param level_start: ``T_odom_camera`` of the first frame, where an accelerometer has made
        ``odom`` level; None: it is not.
    :param timing: milliseconds of each of
        :data:`aick_ros.registration.stage_times.STAGES`, and ``total``.
    """

    stamp: int
    status: Status
    reason: str
    pose: PoseWithCovariance
    prepared: PreparedFrame
    increment: Increment | None = None
    expected: Increment | None = None
    rejected: Increment | None = None
    recovered: bool = False
    predicted: bool = False
    reference: KeypointFrame | None = None
    matches: np.ndarray = field(default_factory=lambda: np.empty((0, 2), np.intp))
    support: int = 0
    evidence: Evidence | None = None
    level_start: np.ndarray | None = None
    timing: dict[str, float] = field(default_factory=dict)

    def handed_over(self, timing: dict[str, float]) -> OdometryUpdate:
        """Return the update with the time it took, and with arrays that its owner may change."""
        def own(motion: Increment | None) -> Increment | None:
            return motion and Increment(motion.pose.copy(), motion.interval)

        return replaced(
            self, pose=self.pose.copy(), increment=own(self.increment),
            expected=own(self.expected), rejected=own(self.rejected),
            matches=self.matches.copy(), timing=timing,
            level_start=None if self.level_start is None else self.level_start.copy())

    def turned(self, turn: Turn) -> OdometryUpdate:
        """Return the update in a frame that begins level, or as without an accelerometer."""
        start = self.level_start if turn.is_level else None
        return replaced(self, pose=turn.apply(self.pose),
                        level_start=None if start is None else turn.T_level_odom @ start)

    @property
    def T_odom_camera(self) -> np.ndarray:
        """Pose of the camera, 4x4 float64 [m]."""
        return self.pose.matrix

    @property
    def keypoints(self) -> KeypointFrame:
        """Keypoints of the frame."""
        return self.prepared.keypoints
