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

from aick_ros.borders.limits import MAX_DISTANCE
from aick_ros.borders.values import numbers
from aick_ros.errors import InputError

_Vector = Sequence[float] | np.ndarray
_SMALL_ANGLE = 1e-4  # rad; derived: below it the next terms of the series are below eps
_FARTHEST = 1e100  # m; derived: its square and the products with it stay finite
_MAX_SKEW = 1e-4  # of R R^T from the identity; chosen: a rotation written with five digits


def transform(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return transformed points, Nx3, of the type of the points."""
    pose = pose.astype(points.dtype)
    moved: np.ndarray = points @ pose[:3, :3].T
    moved += pose[:3, 3]
    return moved


def inverse(pose: np.ndarray) -> np.ndarray:
    """Return the inverse of a pose."""
    inverted = np.zeros((4, 4))
    inverted[:3, :3] = pose[:3, :3].T
    inverted[:3, 3] = -(inverted[:3, :3] @ pose[:3, 3])
    inverted[3, 3] = 1.0
    return inverted


def skew(v: _Vector) -> np.ndarray:
    """Return the matrix of the cross product with v, 3x3."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_rotation(theta: _Vector) -> np.ndarray:
    """Return the rotation matrix of a rotation vector [rad], 3x3 (Rodrigues)."""
    angle = _length(theta)
    # (1 - cos(a))/a^2 in a form that is accurate down to zero
    return _polynomial(theta, _sinc(angle), 0.5 * _sinc(0.5 * angle) ** 2)


def log_rotation(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation vector [rad] of a rotation matrix; its length is 0 to pi."""
    quaternion = to_quaternion(rotation)
    sine = _length(quaternion[:3])
    if sine == 0.0:
        return np.zeros(3)
    vector: np.ndarray = quaternion[:3] * (2.0 * math.atan2(sine, quaternion[3]) / sine)
    return vector


def rotation_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the least rotation from one direction, of length one, to another, 3 [rad]."""
    axis = np.cross(one, other)
    sine, cosine = float(np.linalg.norm(axis)), float(one @ other)
    if sine < 1e-9:  # none, or half a turn about any axis at a right angle
        return np.zeros(3) if cosine > 0.0 else np.pi * np.linalg.svd(one[None])[2][1]
    rotation: np.ndarray = axis * (np.arctan2(sine, cosine) / sine)
    return rotation


def exp(twist: _Vector) -> np.ndarray:
    """Return the pose reached by a constant body twist in unit time (exponential map)."""
    linear, angular = np.asarray(twist, np.float64).reshape(2, 3)
    pose = np.eye(4)
    pose[:3, :3] = exp_rotation(angular)
    pose[:3, 3] = _left_jacobian(angular) @ linear
    return pose


def log(pose: np.ndarray) -> np.ndarray:
    """Return the twist whose exponential is the pose, 6 (logarithmic map)."""
    theta = log_rotation(pose[:3, :3])
    return np.concatenate([_inverse_left_jacobian(theta) @ pose[:3, 3], theta])


def interpolate(start: np.ndarray, end: np.ndarray, fraction: float) -> np.ndarray:
    """Return the pose between two: linear in position, slerp in rotation."""
    pose = np.eye(4)
    rotation_vector = log_rotation(start[:3, :3].T @ end[:3, :3])
    pose[:3, :3] = start[:3, :3] @ exp_rotation(fraction * rotation_vector)
    pose[:3, 3] = (1.0 - fraction) * start[:3, 3] + fraction * end[:3, 3]
    return pose


def angle(rotation: np.ndarray) -> float:
    """Return the angle of a rotation [rad], 0 to pi."""
    return float(np.linalg.norm(log_rotation(rotation)))


def to_quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (x, y, z, w), w >= 0, of a rotation (Shepperd 1978)."""
    r: list[list[float]] = rotation.tolist()
    trace = r[0][0] + r[1][1] + r[2][2]
    diagonal = [r[0][0], r[1][1], r[2][2], trace]
    largest = diagonal.index(max(diagonal))
    if largest == 3:
        q = np.array([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.empty(4)
        q[i] = 1.0 + 2.0 * r[i][i] - trace
        q[j] = r[j][i] + r[i][j]
        q[k] = r[k][i] + r[i][k]
        q[3] = r[k][j] - r[j][k]
    q /= math.copysign(math.hypot(*q.tolist()), q[3])
    return q


def from_quaternion(quaternion: _Vector,
                    translation: _Vector = (0.0, 0.0, 0.0)) -> np.ndarray:
    """
    Return the pose of a quaternion (x, y, z, w) of any length and a translation [m].

    :raises ValueError: if a number is not finite, the quaternion is zero or the translation
        beyond ``MAX_DISTANCE``.
    """
    x, y, z, w = (float(number) for number in quaternion)
    norm = math.hypot(x, y, z, w)
    # not <= is true for NaN
    if not 1e-9 <= norm < math.inf or not math.hypot(*translation) <= MAX_DISTANCE:
        raise ValueError(f'quaternion {x:g} {y:g} {z:g} {w:g} with translation '
                         f'{", ".join(f"{t:g}" for t in translation)} is not a pose')
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
    # comparisons with NaN are false
    if not (np.abs(matrix[:3]) <= (2.0, 2.0, 2.0, MAX_DISTANCE)).all():
        raise InputError(f'{name} is not a pose: its numbers must be finite, the translation at '
                         f'most {MAX_DISTANCE:g} m')
    if not is_rigid(matrix):
        raise InputError(f'{name} is not a pose: a rotation matrix, a translation and the last '
                         'row 0 0 0 1 are required')
    return matrix


def is_rigid(matrix: np.ndarray) -> bool:
    """
    Return whether a matrix, 4x4, is a rigid transformation, all of its numbers finite.

    It is written out: for so few numbers NumPy takes ten times as long.
    """
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = matrix.tolist()
    # comparisons with NaN are false
    return bool(
        abs(a * a + b * b + c * c - 1.0) <= _MAX_SKEW
        and abs(d * d + e * e + f * f - 1.0) <= _MAX_SKEW
        and abs(g * g + h * h + i * i - 1.0) <= _MAX_SKEW
        and abs(a * d + b * e + c * f) <= _MAX_SKEW and abs(a * g + b * h + c * i) <= _MAX_SKEW
        and abs(d * g + e * h + f * i) <= _MAX_SKEW
        and a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0.0
        and abs(x) <= _FARTHEST and abs(y) <= _FARTHEST and abs(z) <= _FARTHEST
        and last == [0.0, 0.0, 0.0, 1.0])


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
    result = pose.copy()
    rotation = exp_rotation(error[3:]) @ pose[:3, :3]
    result[:3, :3] = 1.5 * rotation - 0.5 * rotation @ (rotation.T @ rotation)
    result[:3, 3] += error[:3]
    return result


def difference(pose: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the error of a pose against a reference, 6: the inverse of :func:`perturbed`."""
    return np.concatenate([pose[:3, 3] - reference[:3, 3],
                           log_rotation(pose[:3, :3] @ reference[:3, :3].T)])


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


def scaled(motion: np.ndarray, factor: float) -> np.ndarray:
    """Return the motion of the same constant body twist over a multiple of the time."""
    return motion if factor == 1.0 else exp(factor * log(motion))


def _left_jacobian(theta: np.ndarray) -> np.ndarray:
    """Return the left Jacobian of SO(3), 3x3."""
    angle = _length(theta)
    if angle < _SMALL_ANGLE:
        third = 1.0 / 6.0
    else:
        third = (1.0 - _sinc(angle)) / angle ** 2
    return _polynomial(theta, 0.5 * _sinc(0.5 * angle) ** 2, third)


def _inverse_left_jacobian(theta: np.ndarray) -> np.ndarray:
    """Return the inverse of the left Jacobian of SO(3), 3x3."""
    angle = _length(theta)
    if angle < _SMALL_ANGLE:
        twelfth = 1.0 / 12.0
    else:
        twelfth = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / angle ** 2
    return _polynomial(theta, -0.5, twelfth)


def _length(vector: _Vector) -> float:
    return math.hypot(*vector)


def _sinc(angle: float) -> float:
    """Return sin(a)/a, 1 at zero."""
    return math.sin(angle) / angle if angle else 1.0


def _polynomial(vector: _Vector, first: float, second: float) -> np.ndarray:
    """
    Return I + first * K + second * K^2, K the matrix of the cross product with a vector, 3x3.

    It is written out: for nine numbers NumPy's products take several times as long.
    """
    x, y, z = (float(number) for number in vector)
    xx, yy, zz = second * x * x, second * y * y, second * z * z
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    return np.array([[1.0 - yy - zz, xy - first * z, xz + first * y],
                     [xy + first * z, 1.0 - xx - zz, yz - first * x],
                     [xz - first * y, yz + first * x, 1.0 - xx - yy]])
