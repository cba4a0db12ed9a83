# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Poses of the keyframes, estimated jointly from their relative poses.

The pose graph of the keyframes is a least-squares problem. Its solution and covariance are kept
up to date measurement by measurement, each by one Gauss-Newton step: a Kalman filter whose state
is the keyframes (delayed states; Ila, Porta and Andrade-Cetto, IEEE T-RO 2010). With few keyframes
the dense covariance is small, a keyframe is marginalised by deleting its rows and columns, and
the relative pose of any two has its covariance at once, which the search for known places needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance, at_point, in_axes


@dataclass(frozen=True, eq=False)
class RelativePose:
    """
    A measured pose of one keyframe in another.

    :param first: key of the keyframe in whose frame it is; ``second``: key of the other.
    :param pose: ``T_first_second``, its error independent of those of other measurements.
    """

    first: int
    second: int
    pose: PoseWithCovariance


class KeyframeGraph:
    """
    A joint normal distribution over the poses ``T_odom_keyframe``.

    :param key: of the first keyframe; keys are any distinct numbers.
    """

    def __init__(self, key: int, pose: PoseWithCovariance) -> None:
        self._keys = [key]
        self._poses = pose.matrix[None]
        self._covariance = pose.covariance

    @property
    def keys(self) -> tuple[int, ...]:
        """Keys of the keyframes, in the order in which they were added."""
        return tuple(self._keys)

    @property
    def matrices(self) -> np.ndarray:
        """Estimated ``T_odom_keyframe`` of all keyframes, Nx4x4, in the order of the keys."""
        return self._poses

    def pose(self, key: int) -> PoseWithCovariance:
        """Return the estimated ``T_odom_keyframe`` with its marginal covariance."""
        rows = self._rows(key)
        return PoseWithCovariance(self._poses[self._keys.index(key)],
                                  self._covariance[rows, rows])

    def relative(self, first: int, second: int) -> PoseWithCovariance:
        """Return the estimated ``T_first_second``, the correlation of the two accounted for."""
        rows = np.r_[self._rows(first), self._rows(second)]
        jacobian = self._jacobian(first, second)[:, rows]  # all others are zero
        covariance = self._covariance[np.ix_(rows, rows)]
        return PoseWithCovariance(self._relative(first, second),
                                  jacobian @ covariance @ jacobian.T)

    def relative_variances(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """
        Return the variances of estimated poses ``T_first_second``, summed over the axes.

        :param first: K rows of keyframes, in the order of the keys; ``second``: K others.
        :returns: Kx2, of their positions and of their orientations [m^2, rad^2].
        """
        blocks = self._covariance.reshape(len(self._keys), 6, len(self._keys), 6)
        carry = np.tile(np.eye(6), (len(first), 1, 1))
        places = self._poses[:, :3, 3]
        arms = places[second] - places[first]
        carry[:, [2, 0, 1], [4, 5, 3]] = -arms
        carry[:, [1, 2, 0], [5, 3, 4]] = arms
        carried = carry @ blocks[first, :, first] - 2.0 * blocks[second, :, first]
        variances = (np.einsum('kij,kij->ki', carried, carry)
                     + np.einsum('kii->ki', blocks[second, :, second]))
        sums: np.ndarray = variances.reshape(-1, 2, 3).sum(2)
        return sums

    def add(self, key: int, measurement: PoseWithCovariance, parent: int) -> None:
        """
        Add a keyframe.

        :param measurement: its pose ``T_parent_keyframe`` in one of the graph.
        """
        pose = self._poses[self._keys.index(parent)]
        carry = at_point(pose[:3, :3] @ measurement.translation)
        turn = in_axes(pose[:3, :3])
        cross = carry @ self._covariance[self._rows(parent)]
        own = carry @ cross[:, self._rows(parent)].T + turn @ measurement.covariance @ turn.T
        self._covariance = np.block([[self._covariance, cross.T], [cross, own]])
        self._poses = np.concatenate([self._poses, (pose @ measurement.matrix)[None]])
        self._keys.append(key)

    def remove(self, key: int) -> None:
        """Marginalise a keyframe: its information about the others is kept."""
        index = self._keys.index(key)
        rows = np.arange(6 * index, 6 * index + 6)
        self._covariance = np.delete(np.delete(self._covariance, rows, 0), rows, 1)
        self._poses = np.delete(self._poses, index, 0)
        self._keys.remove(key)

    def squared_distance(self, measurements: Sequence[RelativePose]) -> float:
        """
        Return the squared Mahalanobis distance of measurements from the estimate, all jointly.

        It is chi squared with six degrees of freedom per measurement if all of them are right.
        """
        error, _, innovation = self._linearised(measurements)
        return float(error @ np.linalg.solve(innovation, error))

    def update(self, measurements: Sequence[RelativePose]) -> None:
        """Move all keyframes to the least-squares solution with these measurements added."""
        error, jacobian, innovation = self._linearised(measurements)
        cross = self._covariance @ jacobian.T
        gain = np.linalg.solve(innovation, cross.T).T
        covariance = self._covariance - gain @ cross.T
        self._covariance = 0.5 * (covariance + covariance.T)
        steps = (gain @ error).reshape(-1, 6)
        self._poses = np.array([se3.perturbed(*pair) for pair in zip(self._poses, steps)])

    def _linearised(self, measurements: Sequence[RelativePose]
                    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return errors of the estimate (6K), their Jacobian (6Kx6N) and covariance (6Kx6K)."""
        errors = [se3.difference(m.pose.matrix, self._relative(m.first, m.second))
                  for m in measurements]
        jacobian = np.concatenate([self._jacobian(m.first, m.second) for m in measurements])
        innovation = jacobian @ self._covariance @ jacobian.T
        for i, measurement in enumerate(measurements):
            rows = slice(6 * i, 6 * i + 6)
            innovation[rows, rows] += measurement.pose.covariance
        return np.concatenate(errors), jacobian, innovation

    def _relative(self, first: int, second: int) -> np.ndarray:
        start, end = (self._poses[self._keys.index(key)] for key in (first, second))
        relative: np.ndarray = se3.inverse(start) @ end
        return relative

    def _jacobian(self, first: int, second: int) -> np.ndarray:
        """Return the derivative of the error of ``T_first_second`` by those of all poses, 6x6N."""
        start, end = (self._poses[self._keys.index(key)] for key in (first, second))
        back = in_axes(start[:3, :3].T)
        jacobian = np.zeros((6, len(self._covariance)))
        jacobian[:, self._rows(first)] = -back @ at_point(end[:3, 3] - start[:3, 3])
        jacobian[:, self._rows(second)] = back
        return jacobian

    def _rows(self, key: int) -> slice:
        index = self._keys.index(key)
        return slice(6 * index, 6 * index + 6)
