# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keyframes that were found again in a run, and their errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from unittest import mock

from aick_ros.evaluation.scores.consistency import QUANTILE_997
from aick_ros.evaluation.scores.ground_truth import true_motion
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.odometry.keyframe_graph import KeyframeGraph, RelativePose
from aick_ros.odometry.keyframe_search import KeyframeSearch
from aick_ros.settings import Settings


@dataclass(frozen=True)
class Reuse:
    """
    A keyframe that was found again.

    :param old: stamp of the keyframe [ns]; ``new``: of the one that saw it again.
    :param pose: ``T_old_new`` as registered.
    """

    old: int
    new: int
    pose: PoseWithCovariance

    def error(self, truth: Trajectory) -> IncrementError | None:
        """Return its error; None where the ground truth does not cover it."""
        motion = true_motion(truth, self.old, self.new)
        if motion is None:
            return None
        return IncrementError.of(self.pose.matrix, self.pose.covariance, motion)


def is_false(error: IncrementError) -> bool:
    """
    Return whether the error of a reuse shows that another place was taken for the old one.

    It is above 5 cm or 3 degrees, and outside of the 99.7 % ellipsoid of the covariance.
    """
    return error.is_wrong and error.nees is not None and error.nees > QUANTILE_997


def followed(frames: Iterable[RgbdFrame], settings: Settings = Settings()
             ) -> tuple[list[OdometryUpdate], list[Reuse]]:
    """Return the updates of a run of the odometry, and the keyframes that were found again."""
    reuses, step = [], KeyframeSearch.step

    def recorded(search: KeyframeSearch, graph: KeyframeGraph,
                 frames: Mapping[int, PreparedFrame], *others: Any) -> tuple[RelativePose, ...]:
        accepted = step(search, graph, frames, *others)
        reuses.extend(Reuse(frames[m.first].stamp, frames[m.second].stamp, m.pose)
                      for m in accepted)
        return accepted

    odometry = Odometry(settings)
    with mock.patch.object(KeyframeSearch, 'step', recorded):
        return [odometry.register_frame(frame) for frame in frames], reuses
