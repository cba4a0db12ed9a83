# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
SE(3): inverse, exponential, logarithm, quaternions, and the error of a pose.

A pose is a 4x4 float64 matrix ``T_target_source``. Twists and errors are 6-vectors
(x, y, z, rot x, rot y, rot z). The error model is that of geometry_msgs: with T = [R p], the true
pose is [exp(theta) R, p + delta], in the fixed axes of the target frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from aick_ros import kernels
from aick_ros.borders.limits import MAX_DISTANCE
from aick_ros.borders.values import numbers
from aick_ros.errors import InputError

_Vector = Sequence[float] | np.ndarray


def transform(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return transformed points, Nx3, of the type of the points."""
    moved = np.empty(points.shape)
    kernels.transform(pose, points, moved)
    return moved.astype(points.dtype, copy=False)


def inverse(pose: np.ndarray) -> np.ndarray:
    """Return the inverse of a pose."""
    inverted = np.empty((4, 4))
    kernels.inverse_pose(pose, inverted)
    return inverted


def skew(v: _Vector) -> np.ndarray:
    """Return the matrix of the cross product with v, 3x3."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_rotation(theta: _Vector) -> np.ndarray:
    """Return the rotation matrix of a rotation vector [rad], 3x3 (Rodrigues)."""
    rotation = np.empty((3, 3))
    kernels.exp_rotation(theta, rotation)
    return rotation


def log_rotation(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation vector [rad] of a rotation matrix; its length is 0 to pi."""
    theta = np.empty(3)
    kernels.log_rotation(rotation, theta)
    return theta


def rotation_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the least rotation from one direction, of length one, to another, 3 [rad]."""
    axis = skew(one) @ other
    sine, cosine = math.hypot(*axis), float(one @ other)
    if sine < 1e-9:  # none, or half a turn about any axis at a right angle
        return np.zeros(3) if cosine > 0.0 else np.pi * np.linalg.svd(one[None])[2][1]
    rotation: np.ndarray = axis * (math.atan2(sine, cosine) / sine)
    return rotation


def exp(twist: _Vector) -> np.ndarray:
    """Return the pose reached by a constant body twist in unit time (exponential map)."""
    pose = np.empty((4, 4))
    kernels.exp_pose(twist, pose)
    return pose


def log(pose: np.ndarray) -> np.ndarray:
    """Return the twist whose exponential is the pose, 6 (logarithmic map)."""
    twist = np.empty(6)
    kernels.log_pose(pose, twist)
    return twist


def interpolate(start: np.ndarray, end: np.ndarray, fraction: float) -> np.ndarray:
    """Return the pose between two: linear in position, slerp in rotation."""
    pose = np.eye(4)
    rotation_vector = log_rotation(start[:3, :3].T @ end[:3, :3])
    pose[:3, :3] = start[:3, :3] @ exp_rotation(fraction * rotation_vector)
    pose[:3, 3] = (1.0 - fraction) * start[:3, 3] + fraction * end[:3, 3]
    return pose


def angle(rotation: np.ndarray) -> float:
    """Return the angle of a rotation [rad], 0 to pi."""
    return math.hypot(*log_rotation(rotation))


def to_quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (x, y, z, w), w >= 0, of a rotation (Shepperd 1978)."""
    quaternion = np.empty(4)
    kernels.to_quaternion(rotation, quaternion)
    return quaternion


def from_quaternion(quaternion: _Vector,
                    translation: _Vector = (0.0, 0.0, 0.0)) -> np.ndarray:
    """
    Return the pose of a quaternion (x, y, z, w) of any length and a translation [m].

    :raises ValueError: if a number is not finite, the quaternion is zero or the translation
        beyond ``MAX_DISTANCE``.
    """
    x, y, z, w = (float(number) for number in quaternion)
    norm, distance = math.hypot(x, y, z, w), math.hypot(*translation)
    # not <= is true for NaN
    if not 1e-9 <= norm < math.inf or not distance <= MAX_DISTANCE:
        limit = (f': it is {distance:g} m away, at most {MAX_DISTANCE:g} m are possible'
                 if MAX_DISTANCE < distance < math.inf else '')
        raise ValueError(f'quaternion {x:g} {y:g} {z:g} {w:g} with translation '
                         f'{", ".join(f"{t:g}" for t in translation)} is not a pose{limit}')
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    pose[:3, 3] = translation
    return pose


def checked(pose: object, name: str) -> np.ndarray:
    """
    Return a pose from outside as float64, 4x4.

    :raises InputError: where it is not a rigid transformation within ``MAX_DISTANCE``.
    """
    try:
        matrix = numbers(pose, (4, 4), name).copy()
    except InputError:
        raise InputError(f'{name} is not a pose: a 4x4 matrix is required') from None
    if is_rigid(matrix) and max(map(abs, matrix[:3, 3].tolist())) <= MAX_DISTANCE:
        return matrix
    # comparisons with NaN are false
    if not (np.abs(matrix[:3]) <= (2.0, 2.0, 2.0, MAX_DISTANCE)).all():
        raise InputError(f'{name} is not a pose: its numbers must be finite, the translation at '
                         f'most {MAX_DISTANCE:g} m')
    raise InputError(f'{name} is not a pose: a rotation matrix, a translation and the last row '
                     '0 0 0 1 are required')


def is_rigid(matrix: np.ndarray) -> bool:
    """Return whether a matrix, 4x4, is a rigid transformation, all of its numbers finite."""
    return kernels.is_rigid(matrix)


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float,
                        translation: _Vector = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Return the pose of rotations about the fixed axes x, then y, then z [rad] (REP-103)."""
    pose = np.eye(4)
    pose[:3, :3] = (exp_rotation((0.0, 0.0, yaw)) @ exp_rotation((0.0, pitch, 0.0))
                    @ exp_rotation((roll, 0.0, 0.0)))
    pose[:3, 3] = translation
    return pose


def perturbed(pose: np.ndarray, error: np.ndarray) -> np.ndarray:
    """
    Return a pose with an error added in the axes of the target frame (boxplus).

    Its rotation is orthonormal to rounding, by a Newton step to the nearest one (Higham 1986).
    Without, what rounding leaves would grow exponentially along a chain of poses each of which is
    estimated from a motion between those before.
    """
    result = np.empty((4, 4))
    kernels.perturbed_pose(pose, error, result)
    return result


def difference(pose: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the error of a pose against a reference, 6: the inverse of :func:`perturbed`."""
    error = np.empty(6)
    kernels.pose_difference(pose, reference, error)
    return error


def point_jacobian(arms: np.ndarray) -> np.ndarray:
    """
    Return the derivatives of transformed points with respect to the error of the pose, Nx3x6.

    :param arms: Nx3, the points rotated but not translated by the pose.
    """
    jacobian = np.zeros((len(arms), 3, 6))
    jacobian[:, (0, 1, 2), (0, 1, 2)] = 1.0
    jacobian[:, (1, 2, 0), (5, 3, 4)] = arms
    jacobian[:, (2, 0, 1), (4, 5, 3)] = -arms
    return jacobian
