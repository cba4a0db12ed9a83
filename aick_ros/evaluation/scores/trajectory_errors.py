# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Relative and absolute errors of a trajectory (Sturm et al., IROS 2012).

Both are taken at the stamps of the estimate; the ground truth is interpolated there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.pairs import MAX_HOLE
from aick_ros.geometry import point_fit, se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class TrajectoryErrors:
    """
    An estimate beside the ground truth, N poses at the same stamps.

    :param estimate: ``T_odom_camera``.
    :param truth: ``T_world_camera``.
    :param T_world_odom: 4x4, the alignment with the least squared distance of the positions.
    """

    estimate: Trajectory
    truth: Trajectory
    T_world_odom: np.ndarray

    @property
    def aligned(self) -> np.ndarray:
        """The estimate in the world, Nx4x4."""
        return self.T_world_odom @ self.estimate.poses

    def positions(self) -> np.ndarray:
        """Return the distance of each aligned position to the true one, N [m]."""
        difference = self.aligned[:, :3, 3] - self.truth.poses[:, :3, 3]
        return np.linalg.norm(difference, axis=1)

    def rotations(self) -> np.ndarray:
        """
        Return the angle between each rotation and the true one, N [rad].

        After the alignment that fits the rotations best: that of the positions leaves the turn
        about a straight path to chance.
        """
        return _angles(_relative(self.truth.poses, _turn(self.estimate.poses, self.truth.poses)))

    def relative(self, interval: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the errors of the motion over an interval, of all pairs that far apart.

        The partner of a pose is the one nearest to an interval later, if it is nearer than half a
        median period.

        :param interval: [s].
        :returns: K translations [m] and K rotations [rad].
        """
        first, second = _pairs(self.estimate.stamps, interval)
        moved = _relative(self.estimate.poses[first], self.estimate.poses[second])
        truly_moved = _relative(self.truth.poses[first], self.truth.poses[second])
        errors = _relative(truly_moved, moved)
        return np.linalg.norm(errors[:, :3, 3], axis=1), _angles(errors)


def compare(estimate: Trajectory, ground_truth: Trajectory) -> TrajectoryErrors | None:
    """
    Return the errors of an estimate.

    :returns: None where the ground truth covers no stamp of the estimate.
    """
    true_poses = [ground_truth.at(int(stamp), MAX_HOLE) for stamp in estimate.stamps]
    covered = [i for i, pose in enumerate(true_poses) if pose is not None]
    if not covered:
        return None
    stamps, poses = estimate.stamps[covered], estimate.poses[covered]
    truth = np.array([true_poses[i] for i in covered])
    return TrajectoryErrors(Trajectory(stamps, poses), Trajectory(stamps, truth),
                            _align(poses, truth))


def _align(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    try:
        return point_fit.fit(poses[:, :3, 3], truth[:, :3, 3])
    except point_fit.DegenerateGeometryError:
        # a camera that stood still or moved on a line: the rotations decide what is left open
        reach = 1e-2 * float(np.ptp(truth[:, :3, 3], axis=0).max()) or 1.0
        return point_fit.fit(_with_axes(poses, reach), _with_axes(truth, reach))


def _turn(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the poses turned as one, so that their rotations are nearest to the true ones."""
    axes, true_axes = (p[:, :3, :3].transpose(0, 2, 1).reshape(-1, 3) for p in (poses, truth))
    return point_fit.fit(np.r_[axes, -axes], np.r_[true_axes, -true_axes]) @ poses


def _with_axes(poses: np.ndarray, reach: float) -> np.ndarray:
    """Return the positions and a point close by on each axis of each pose, 4Nx3 [m]."""
    positions = poses[:, :3, 3]
    axes = reach * poses[:, :3, :3].transpose(2, 0, 1)
    return np.concatenate([positions, *(positions + axis for axis in axes)])


def _pairs(stamps: np.ndarray, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the poses an interval [s] apart, first and second."""
    if len(stamps) < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    wanted = stamps + round(interval * NANOSECONDS)
    after = np.clip(np.searchsorted(stamps, wanted), 1, len(stamps) - 1)
    second = after - (wanted - stamps[after - 1] <= stamps[after] - wanted)
    nearer = 2 * np.abs(stamps[second] - wanted) < np.median(np.diff(stamps))
    first = np.flatnonzero(nearer & (second > np.arange(len(stamps))))
    return first, second[first]


def _relative(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the inverses of the first poses times the second, Nx4x4."""
    rotations = first[:, :3, :3].transpose(0, 2, 1)
    moved = np.tile(np.eye(4), (len(first), 1, 1))
    moved[:, :3, :3] = rotations @ second[:, :3, :3]
    moved[:, :3, 3:] = rotations @ (second[:, :3, 3:] - first[:, :3, 3:])
    return moved


def _angles(poses: np.ndarray) -> np.ndarray:
    return np.array([se3.angle(pose[:3, :3]) for pose in poses])
