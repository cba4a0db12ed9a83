# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Poses and motions of the camera by the ground truth, interpolated between two of its poses.

Interpolation follows the straight line, so its error grows with the square of the interval.
Measured at the images of freiburg1_xyz_150 and of freiburg1_rpy_100, moved by hand, with poses
dropped from their ground truth of 100 Hz (``benchmarks/sparse_truth.py``), it is (RMS):

======== ============== =================
interval position [mm]  rotation [deg]
======== ============== =================
0.05 s   0.29 and 0.21  0.13 and 0.17
0.1 s    0.89 and 0.49  0.26 and 0.47
0.15 s   1.90 and 0.93  0.41 and 0.90
0.2 s    3.30 and 1.57  0.60 and 1.38
0.5 s    18.9 and 7.22  1.85 and 4.68
======== ============== =================

The nearest pose would be worse: at a distance of 5 ms it is 1.8 mm off in the first recording.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory

MAX_INTERPOLATION_GAP = 0.05  # chosen: five periods of motion capture at 100 Hz
"""Longest gap that is interpolated in a ground truth of 30 Hz and more [s]."""

MAX_SPARSE_GAP = 0.15  # chosen: 10 Hz with jitter; the error adds 3 % to an ATE of 7.5 mm
"""Longest gap that is interpolated in any ground truth [s]."""

_PERIODS = 1.5  # chosen: stamps jitter by less than half a period, a lost pose is a gap of two


def longest_gap(ground_truth: Trajectory) -> float:
    """
    Return the longest interval between two poses that is interpolated [s].

    It is 0.05 s, or 1.5 times the median interval of a ground truth that is sparse throughout, but
    at most 0.15 s. So a gap in a dense ground truth stays a gap.
    """
    sparse = min(_PERIODS * ground_truth.median_interval, MAX_SPARSE_GAP)
    return max(sparse, MAX_INTERPOLATION_GAP)


def true_pose(ground_truth: Trajectory, stamp: int) -> np.ndarray | None:
    """Return ``T_world_camera`` at a stamp [ns]; None where the ground truth does not cover it."""
    return ground_truth.at(stamp, longest_gap(ground_truth))


def true_motion(ground_truth: Trajectory, target_stamp: int,
                source_stamp: int) -> np.ndarray | None:
    """Return the true ``T_target_source``; None where the ground truth lacks one of the poses."""
    T_world_target = true_pose(ground_truth, target_stamp)
    T_world_source = true_pose(ground_truth, source_stamp)
    if T_world_target is None or T_world_source is None:
        return None
    T_target_source: np.ndarray = se3.inverse(T_world_target) @ T_world_source
    return T_target_source
