# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Relative and absolute errors of a trajectory (Sturm et al., IROS 2012).

Both are evaluated at the stamps of the estimate, where the ground truth is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.geometry import point_fit, se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class TrajectoryErrors:
    """
    An estimate and its ground truth, N poses at the same stamps.

    :param estimate: ``T_odom_camera``.
    :param truth: ``T_world_camera``.
    :param T_world_odom: 4x4, the least-squares alignment of the positions.
    """

    estimate: Trajectory
    truth: Trajectory
    T_world_odom: np.ndarray

    @property
    def aligned(self) -> np.ndarray:
        """The estimate in the world frame, Nx4x4."""
        poses: np.ndarray = self.T_world_odom @ self.estimate.poses
        return poses

    def positions(self) -> np.ndarray:
        """Return the position error of each aligned pose, N [m]."""
        return _norms(self.aligned[:, :3, 3] - self.truth.poses[:, :3, 3])

    def rotations(self) -> np.ndarray:
        """
        Return the rotation error of each pose, N [rad].

        The rotations have an alignment of their own: that of the positions leaves the rotation
        about a straight path undetermined.
        """
        return _angles(_relative(self.truth.poses,
                                 _align_rotations(self.estimate.poses, self.truth.poses)))

    def relative(self, interval: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the relative errors over an interval (RPE), of all pairs of poses.

        Each pose is paired with the one closest to an interval later, if that is within half a
        median period.

        :param interval: [s].
        :returns: translation errors, K [m], and rotation errors, K [rad].
        """
        return self.relative_from(interval)[1:]

    def relative_from(self, interval: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """
        Return the relative errors of :meth:`relative`, and where they begin.

        :returns: indices of the first poses of the pairs, K, and their errors.
        """
        first, second = _pairs(self.estimate.stamps, interval)
        motions = _relative(self.estimate.poses[first], self.estimate.poses[second])
        true_motions = _relative(self.truth.poses[first], self.truth.poses[second])
        errors = _relative(true_motions, motions)
        return first, _norms(errors[:, :3, 3]), _angles(errors)


def compare(estimate: Trajectory, ground_truth: Trajectory) -> TrajectoryErrors | None:
    """
    Return the errors of an estimate.

    :returns: None where the ground truth covers no stamp of the estimate.
    """
    true_poses = [true_pose(ground_truth, int(stamp)) for stamp in estimate.stamps]
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
        # the camera stood still or moved on a line: the rotations determine the rest
        length = 1e-2 * float(np.ptp(truth[:, :3, 3], axis=0).max()) or 1.0  # chosen
        return point_fit.fit(_with_axes(poses, length), _with_axes(truth, length))


def _align_rotations(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the poses after the common rotation that best aligns their axes to the true ones."""
    axes, true_axes = (p[:, :3, :3].transpose(0, 2, 1).reshape(-1, 3) for p in (poses, truth))
    aligned: np.ndarray = point_fit.fit(np.r_[axes, -axes], np.r_[true_axes, -true_axes]) @ poses
    return aligned


def _with_axes(poses: np.ndarray, length: float) -> np.ndarray:
    """Return the positions, and the points at a length [m] on the axes of each pose, 4Nx3 [m]."""
    positions = poses[:, :3, 3]
    axes = length * poses[:, :3, :3].transpose(2, 0, 1)
    return np.concatenate([positions, *(positions + axis for axis in axes)])


def _pairs(stamps: np.ndarray, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the first and of the second poses of all pairs over an interval."""
    if len(stamps) < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    wanted = stamps + round(interval * NANOSECONDS)
    after = np.clip(np.searchsorted(stamps, wanted), 1, len(stamps) - 1)
    second = after - (wanted - stamps[after - 1] <= stamps[after] - wanted)
    is_close = 2 * np.abs(stamps[second] - wanted) < np.median(np.diff(stamps))
    first = np.flatnonzero(is_close & (second > np.arange(len(stamps))))
    return first, second[first]


def _relative(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return ``inverse(first) @ second`` of each pair of poses, Nx4x4."""
    rotations = first[:, :3, :3].transpose(0, 2, 1)
    motions = np.tile(np.eye(4), (len(first), 1, 1))
    motions[:, :3, :3] = rotations @ second[:, :3, :3]
    motions[:, :3, 3:] = rotations @ (second[:, :3, 3:] - first[:, :3, 3:])
    return motions


def _norms(vectors: np.ndarray) -> np.ndarray:
    norms: np.ndarray = np.linalg.norm(vectors, axis=1)
    return norms


def _angles(poses: np.ndarray) -> np.ndarray:
    return np.array([se3.angle(pose[:3, :3]) for pose in poses])
