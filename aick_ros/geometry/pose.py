# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A pose with its covariance, and the increment of a moving body between two stamps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aick_ros.geometry import se3


@dataclass(frozen=True, eq=False)
class PoseWithCovariance:
    """
    A pose ``T_target_source`` and the covariance of its error.

    The error is that of geometry_msgs: with T = [R p], the true pose is [exp(theta) R, p + delta],
    (delta, theta) about the fixed axes of the target frame. Composition takes the errors of both
    poses as independent. A plain 4x4 matrix composes as a pose without error, from either side.

    :param matrix: 4x4 float64 [m].
    :param covariance: 6x6 float64 (x, y, z, rot x, rot y, rot z) [m^2, m rad, rad^2].
    """

    matrix: np.ndarray
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))

    __array_ufunc__ = None  # so that `matrix @ pose` reaches __rmatmul__

    @classmethod
    def identity(cls) -> PoseWithCovariance:
        """Return the pose that moves nothing, without error."""
        return cls(np.eye(4))

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrix, 3x3."""
        return self.matrix[:3, :3]

    @property
    def translation(self) -> np.ndarray:
        """Translation [m], 3."""
        return self.matrix[:3, 3]

    def __matmul__(self, other: PoseWithCovariance | np.ndarray) -> PoseWithCovariance:
        """Return ``T_a_b @ T_b_c``: the errors of both, turned and levered into frame a."""
        if isinstance(other, np.ndarray):
            other = PoseWithCovariance(other)
        lever = _lever(self.rotation @ other.translation)
        turn = _turn(self.rotation)
        return PoseWithCovariance(
            self.matrix @ other.matrix,
            lever @ self.covariance @ lever.T + turn @ other.covariance @ turn.T)

    def __rmatmul__(self, matrix: np.ndarray) -> PoseWithCovariance:
        """Return ``T_a_b @ T_b_c`` of a first pose without error."""
        return PoseWithCovariance(matrix) @ self

    def inverse(self) -> PoseWithCovariance:
        """Return ``T_source_target`` with the covariance of its error about the source's axes."""
        back = _turn(self.rotation.T) @ _lever(-self.translation)
        return PoseWithCovariance(se3.inverse(self.matrix), back @ self.covariance @ back.T)

    def relative_to(self, start: PoseWithCovariance) -> PoseWithCovariance:
        """Return ``inverse(start) @ self``, both given in the same frame."""
        return start.inverse() @ self

    def in_body(self, T_base_camera: np.ndarray) -> PoseWithCovariance:
        """
        Return the motion of the base that carries a camera, from this motion of the camera.

        :param T_base_camera: the extrinsic, 4x4, taken as exact.
        """
        return T_base_camera @ self @ se3.inverse(T_base_camera)


@dataclass(frozen=True, eq=False)
class Increment:
    """
    The motion of a body from an earlier stamp to a later one.

    :param pose: ``T_body0_body1``, with its covariance in the axes of the earlier body.
    :param interval: time between the two [s], positive.
    """

    pose: PoseWithCovariance
    interval: float

    @property
    def twist(self) -> np.ndarray:
        """Constant body velocity (vx, vy, vz, wx, wy, wz) of the motion [m/s, rad/s], 6."""
        return se3.log(self.pose.matrix) / self.interval

    def in_body(self, T_base_camera: np.ndarray) -> Increment:
        """Return the increment of the base that carries a camera; see the pose's."""
        return Increment(self.pose.in_body(T_base_camera), self.interval)


def unknown_covariance() -> np.ndarray:
    """Return the 6x6 covariance of a pose of which nothing is known: infinite on the diagonal."""
    return np.diag(np.full(6, np.inf))


def _turn(rotation: np.ndarray) -> np.ndarray:
    """Return the 6x6 matrix that turns the axes of an error."""
    return np.kron(np.eye(2), rotation)


def _lever(arm: np.ndarray) -> np.ndarray:
    """Return the 6x6 matrix that carries an error to a point at the end of an arm [m]."""
    carry = np.eye(6)
    carry[:3, 3:] = -se3.skew(arm)
    return carry
