# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A pose with covariance, and the motion of a body between two stamps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from aick_ros import kernels
from aick_ros.borders.values import number, numbers, required
from aick_ros.errors import InputError
from aick_ros.geometry import definite, se3

_UNMOVED, _EXACT = np.eye(4), np.zeros((6, 6))
_EXACT.flags.writeable = False


@dataclass(frozen=True, eq=False)
class PoseWithCovariance:
    """
    A pose ``T_target_source`` and the covariance of its error, propagated to first order.

    The error model is that of geometry_msgs: with T = [R p], the true pose is
    [exp(theta) R, p + delta], where (delta, theta) is given in the fixed axes of the target frame.
    Composition assumes independent errors. A 4x4 matrix on either side composes as an exact pose.

    :param matrix: 4x4 float64 [m].
    :param covariance: 6x6 float64 (x, y, z, rot x, rot y, rot z) [m^2, m rad, rad^2].
    :raises InputError: where the matrix is no rigid transformation, or the covariance not 6x6.
    """

    matrix: np.ndarray
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))

    __array_ufunc__ = None  # NumPy: leave `matrix @ pose` to __rmatmul__

    def __post_init__(self) -> None:
        """Reject what is no pose; numbers of other types become float64."""
        matrix, covariance = _rigid(self.matrix), self.covariance
        if matrix is not self.matrix:
            object.__setattr__(self, 'matrix', matrix)
        if not (type(covariance) is np.ndarray and covariance.dtype == np.float64
                and covariance.shape == (6, 6)):
            object.__setattr__(self, 'covariance', numbers(
                covariance, (6, 6), 'the covariance of a pose'))

    @classmethod
    def _made(cls, matrix: np.ndarray, covariance: np.ndarray) -> PoseWithCovariance:
        """Return a pose of arrays that come from those of other poses, which were checked."""
        pose = object.__new__(cls)
        object.__setattr__(pose, 'matrix', matrix)
        object.__setattr__(pose, 'covariance', covariance)
        return pose

    @classmethod
    def identity(cls) -> PoseWithCovariance:
        """Return the identity, without error."""
        return cls._made(_UNMOVED.copy(), np.zeros((6, 6)))

    def with_covariance(self, covariance: np.ndarray) -> PoseWithCovariance:
        """Return the same pose with another covariance, 6x6 float64."""
        return PoseWithCovariance._made(self.matrix, covariance)

    def copy(self) -> PoseWithCovariance:
        """Return a pose with arrays of its own."""
        return PoseWithCovariance._made(self.matrix.copy(), self.covariance.copy())

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrix, 3x3."""
        return self.matrix[:3, :3]

    @property
    def translation(self) -> np.ndarray:
        """Translation [m], 3."""
        return self.matrix[:3, 3]

    def __matmul__(self, other: PoseWithCovariance | np.ndarray) -> PoseWithCovariance:
        """Return ``T_a_c = T_a_b @ T_b_c`` of this pose and another one."""
        pose, covariance = np.empty((4, 4)), np.empty((6, 6))
        other = _pose(other)
        kernels.composed_poses(self.matrix, self.covariance, other.matrix, other.covariance, pose,
                               covariance)
        return PoseWithCovariance._made(pose, covariance)

    def __rmatmul__(self, matrix: np.ndarray) -> PoseWithCovariance:
        """Return ``T_a_c = T_a_b @ T_b_c`` of an exact pose and this one."""
        return _pose(matrix) @ self

    def inverse(self) -> PoseWithCovariance:
        """Return ``T_source_target``, its covariance in the axes of the source."""
        return PoseWithCovariance.identity().relative_to(self)

    def relative_to(self, start: PoseWithCovariance) -> PoseWithCovariance:
        """Return ``inverse(start) @ self`` of two poses with independent errors in one frame."""
        return self._seen_from(start, 1.0)

    def since(self, start: PoseWithCovariance) -> PoseWithCovariance:
        """
        Return ``inverse(start) @ self`` of a later pose on the same path.

        Its covariance is what has been added along the path: that of the later pose contains that
        of the start.
        """
        motion = self._seen_from(start, -1.0)
        return PoseWithCovariance._made(motion.matrix, definite.nonnegative(motion.covariance))

    def _seen_from(self, start: PoseWithCovariance, times: float) -> PoseWithCovariance:
        """Return ``inverse(start) @ self``, with the covariance of the start some times added."""
        motion, covariance, start = np.empty((4, 4)), np.empty((6, 6)), _pose(start)
        kernels.relative_pose(start.matrix, start.covariance, self.matrix, self.covariance, times,
                              motion, covariance)
        return PoseWithCovariance._made(motion, covariance)

    def in_body(self, T_base_camera: np.ndarray) -> PoseWithCovariance:
        """
        Return the motion of a base, if this is the motion of a camera fixed to it.

        :param T_base_camera: extrinsic calibration, 4x4, assumed exact.
        """
        T_base_camera = se3.checked(T_base_camera, 'T_base_camera')
        return PoseWithCovariance(T_base_camera) @ self @ se3.inverse(T_base_camera)


@dataclass(frozen=True, eq=False)
class Increment:
    """
    Motion of a body between two stamps.

    :param pose: ``T_body0_body1``, the later pose in the earlier body frame, with covariance.
    :param interval: time between the stamps [s], positive.
    :raises InputError: where the interval is not positive and finite.
    """

    pose: PoseWithCovariance
    interval: float

    def __post_init__(self) -> None:
        """Reject what is no motion."""
        required(self.pose, PoseWithCovariance, 'the pose of an increment')
        if not 0.0 < number(self.interval, 'the interval of an increment') < math.inf:
            raise InputError(f'the interval of an increment is {self.interval}: a positive '
                             'number of seconds is required')

    @property
    def twist(self) -> np.ndarray:
        """Constant body twist that gives the motion, (vx, vy, vz, wx, wy, wz) [m/s, rad/s]."""
        return se3.log(self.pose.matrix) / self.interval

    def in_body(self, T_base_camera: np.ndarray) -> Increment:
        """
        Return the motion of a base, if this is the motion of a camera fixed to it.

        :param T_base_camera: extrinsic calibration, 4x4, assumed exact.
        """
        return Increment(self.pose.in_body(T_base_camera), self.interval)


def _pose(pose: PoseWithCovariance | np.ndarray) -> PoseWithCovariance:
    """Return a pose, an exact one of a matrix."""
    return (pose if isinstance(pose, PoseWithCovariance)
            else PoseWithCovariance._made(_rigid(pose), _EXACT))


def _rigid(matrix: np.ndarray) -> np.ndarray:
    """Return the matrix of a pose as float64, 4x4; it itself, if it is one."""
    # most are made here, and are of float64
    if (type(matrix) is np.ndarray and matrix.dtype == np.float64 and matrix.shape == (4, 4)
            and se3.is_rigid(matrix)):
        return matrix
    return se3.checked(matrix, 'the matrix of a pose')


def unknown_covariance() -> np.ndarray:
    """Return the 6x6 covariance of a pose without any information, infinite on the diagonal."""
    return np.diag(np.full(6, np.inf))


def along_all_axes(along: float, about: float) -> np.ndarray:
    """
    Return the covariance of an error that is alike along, and about, all axes, 6x6.

    :param along: variance along an axis [m^2].
    :param about: variance about an axis [rad^2].
    """
    covariance = np.zeros((6, 6))
    covariance.ravel()[::7] = along, along, along, about, about, about
    return covariance


def sums_along_and_about(squares: np.ndarray) -> np.ndarray:
    """Return the sums of six squares, of a twist or a pose: along the axes and about them, 2."""
    sums: np.ndarray = squares.reshape(2, 3).sum(1)
    return sums


def in_axes(rotation: np.ndarray) -> np.ndarray:
    """Return the 6x6 matrix that expresses an error in rotated axes."""
    axes = np.zeros((6, 6))
    axes[:3, :3] = axes[3:, 3:] = rotation
    return axes


def at_point(arm: np.ndarray) -> np.ndarray:
    """Return the 6x6 matrix that moves an error to a point displaced by a lever arm [m]."""
    jacobian = np.eye(6)
    jacobian[:3, 3:] = -se3.skew(arm)
    return jacobian


def of_inverse(pose: np.ndarray) -> np.ndarray:
    """Return the 6x6 matrix that makes of an error of a pose, 4x4, that of its inverse."""
    jacobian: np.ndarray = -in_axes(pose[:3, :3].T) @ at_point(-pose[:3, 3])
    return jacobian
