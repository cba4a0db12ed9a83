# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses and motions of the camera by the ground truth."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory

MAX_INTERPOLATION_GAP = 0.05  # chosen: five periods of motion capture at 100 Hz
"""Longest gap of the ground truth that is interpolated [s]."""


def true_pose(ground_truth: Trajectory, stamp: int) -> np.ndarray | None:
    """Return ``T_world_camera`` at a stamp [ns]; None where the ground truth does not cover it."""
    return ground_truth.at(stamp, MAX_INTERPOLATION_GAP)


def true_motion(ground_truth: Trajectory, target_stamp: int,
                source_stamp: int) -> np.ndarray | None:
    """Return the true ``T_target_source``; None where the ground truth lacks one of the poses."""
    T_world_target = true_pose(ground_truth, target_stamp)
    T_world_source = true_pose(ground_truth, source_stamp)
    if T_world_target is None or T_world_source is None:
        return None
    T_target_source: np.ndarray = se3.inverse(T_world_target) @ T_world_source
    return T_target_source
