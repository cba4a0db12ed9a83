# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Errors of a registration that neither its residuals nor the registrations before it show.

A bias between keypoints and depth that is far larger than usual means that something may move in
front of the camera. Jitter of the stamps means that the clock lags.
"""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.borders.records import replaced
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import along_all_axes, at_point, in_axes, sums_along_and_about
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.result import Registration, SensorBias

_MEMORY = 30  # registrations; chosen

_PRIOR_NORMALISED, _PRIOR_WEIGHT = 1.7, 3
"""Prior of the normalised squared bias, and its weight in registrations. Chosen; noise gives 1."""

_UNUSUAL_BOUNDS = 2.5, 3.0
"""Normalised squared bias of one registration, as a ratio to the usual one (at least 1): up to the
first it is noise, from the second on fully systematic, linear in between. Derived: noise of six
values exceeds them in 20 and in 6 of 1000 registrations."""

_STAMP_SIGMA, _STAMP_SIGMA_PER_JITTER = 0.005, 3.3
"""Standard deviation of each stamp that is given on arrival [s], and its bound by the jitter.

Measured on a Kinect: about 5 ms, where stamps jitter by 1.2 to 3.3 ms. It is never below the
jitter, and stamps that do not jitter have no error."""

_LATENCY_SIGMA, _LATENCY_SIGMA_PER_JITTER = 0.025, 25.0
"""Standard deviation of the common delay of all stamps [s], and its bound by the jitter.

Chosen: delays from 5 to 35 ms have a root mean square of 22 ms, but all increments of a camera
have the same one, so that of those with a long delay too many would be outside. Measured on a
Kinect: 10 to 15 ms, where stamps jitter by 1.2 to 3.3 ms. All of it counts from a jitter of 1 ms
on; chosen, below the smallest one measured."""

_ACROSS = np.array([1.0, 1.0, 0.0, 1.0, 1.0, 0.0])  # by definition: components across the axis


class SystematicError:
    """Adds systematic errors to the covariances of one camera's registrations, in time order."""

    def __init__(self) -> None:
        self._count = _PRIOR_WEIGHT
        self._normalised = _PRIOR_NORMALISED  # mean normalised squared bias

    def add_to(self, registration: Registration, source: PreparedFrame, target: PreparedFrame,
               expected: ExpectedPose | None = None, delay_sigma: float = 0.0) -> Registration:
        """
        Return a registration with the covariance of these errors too.

        :param expected: of which the pose at constant velocity counts; None: it is unknown.
        :param delay_sigma: standard deviation of the time from the colour to the depth image
            that the pose is corrected by [s].
        """
        if not registration.status.ok:
            return registration
        motion, interval = registration.T_target_source, seconds(target.stamp, source.stamp)
        change = np.zeros(6)
        if expected is not None and interval != 0.0:
            # a velocity is no older than the frame that it was measured at
            change = se3.difference(motion, expected.at_constant_velocity) / min(
                expected.elapsed, abs(interval))
        timing = errors_of_stamps(
            motion, source, target, sums_along_and_about(np.square(change)))
        # an error of the delay shifts the motion by this change, and in no other direction
        unusual = delay_sigma ** 2 * np.outer(change, change)
        if registration.bias is not None:
            unusual += along_all_axes(*self._unusual(registration.bias))
            self._learn(registration.bias)
        return replaced(
            registration, covariance=registration.covariance + timing + unusual,
            timing=timing, unusual=unusual)

    def _unusual(self, bias: SensorBias) -> tuple[float, float]:
        """Return the mean squares of the share of a bias that is not usual [m^2, rad^2]."""
        noise, systematic = _UNUSUAL_BOUNDS
        ratio = bias.normalised / max(self._normalised, 1.0)
        share = min(max((ratio - noise) / (systematic - noise), 0.0), 1.0)
        along, about = bias.squares
        return share * along, share * about

    def _learn(self, bias: SensorBias) -> None:
        self._count = min(self._count + 1, _MEMORY)
        self._normalised += (bias.normalised - self._normalised) / self._count


def errors_of_stamps(motion: np.ndarray, source: PreparedFrame, target: PreparedFrame,
                     changes: np.ndarray, unknown_jitter: float = 0.0) -> np.ndarray:
    """
    Return the covariance that errors of two stamps add to a motion, 6x6.

    :param motion: ``T_target_source`` as the images show it, 4x4.
    :param changes: squares of the change of the velocity since it was measured, of translation
        and rotation, 2 [m^2/s^2, rad^2/s^2].
    :param unknown_jitter: where there were too few stamps to show any [s].
    """
    shown = [each.stamp_jitter for each in (source, target) if each.stamp_jitter is not None]
    jitter = max(shown, default=unknown_jitter)
    covariance = np.empty((6, 6))
    kernels.stamp_errors(
        motion, source.twist, target.twist, changes, seconds(target.stamp, source.stamp),
        stamp_sigma(jitter) ** 2, _latency_sigma(jitter) ** 2 / 3, covariance)
    return covariance


def errors_of_offset(motion: np.ndarray, offset: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """
    Return the covariance that an offset of depth to colour adds to a motion, 6x6.

    Depth shows the motion X^-1 T X in place of T: X is the offset that is not corrected.

    :param motion: ``T_target_source`` or the motion between two such poses, 4x4.
    :param offset: 6x6, covariance of X, a twist [m, rad].
    :param gain: 6x6, by which the motion follows depth.
    """
    by_offset = gain @ (in_axes(motion[:3, :3]) - at_point(motion[:3, 3]))
    covariance: np.ndarray = by_offset @ offset @ by_offset.T
    return covariance


def errors_of_optics(motion: np.ndarray, errors: np.ndarray, gain: np.ndarray,
                     camera: Camera) -> np.ndarray:
    """
    Return the covariance that errors of two focal lengths and of a lens add to a motion, 6x6.

    A focal length that is too short shows all rays too steep: motions across the optical axis, and
    turns about axes across it, are too large by as much, to first order. A lens with a radial
    coefficient k shows the radius r of a ray too large by k r^3, and where it moves its motion by
    3 k r^2 along the radius. In the mean over a scene of many depths that is about 2 k r^2.

    :param motion: ``T_target_source`` or the motion between two such poses, 4x4.
    :param errors: 3x3, covariance of the relative errors of the colour and the depth image, and
        of the radial coefficient of the colour camera's lens.
    :param gain: 6x6, by which the motion follows depth.
    """
    twist = se3.log(motion)
    across, of_lens = _ACROSS * twist, _by_lens(camera) * twist
    by_depth = gain @ across
    by_errors = np.column_stack([across - by_depth, by_depth, of_lens - gain @ of_lens])
    covariance: np.ndarray = by_errors @ errors @ by_errors.T
    return covariance


def _by_lens(camera: Camera) -> np.ndarray:
    """
    Return by how much a unit of a radial coefficient lengthens the components of a motion, 6.

    Across the axis points all over the image show the motion, along it those far from the centre.
    """
    x, y = 0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy
    square = (x ** 2 + y ** 2) / 3.0  # means of r^2 and of r^4 over the image
    fourth = (x ** 4 + y ** 4) / 5.0 + 2.0 * x ** 2 * y ** 2 / 9.0
    by_lens = 2.0 * square * _ACROSS
    by_lens[2] = 2.0 * fourth / square
    return by_lens


def errors_of_scale(translation: np.ndarray, sigma: float) -> np.ndarray:
    """
    Return the covariance that a scale error of depth adds to a pose, 6x6 [m^2, m rad, rad^2].

    Depths that are all too long by a share lengthen translations by the same share, and turn
    nothing. No residual shows it. All motions of a camera have the error in common: along a path
    it does not add up as independent errors do.

    :param translation: 3 [m].
    :param sigma: standard deviation of the share.
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = sigma ** 2 * np.outer(translation, translation)
    return covariance


def stamp_sigma(jitter: float) -> float:
    """Return the standard deviation of each stamp [s], by their jitter [s]."""
    return max(jitter, min(_STAMP_SIGMA, _STAMP_SIGMA_PER_JITTER * jitter))


def _latency_sigma(jitter: float) -> float:
    """
    Return the standard deviation of the common delay of all stamps [s], by their jitter [s].

    It shifts the motion by the change of the velocity, in a third per axis.
    """
    return min(_LATENCY_SIGMA, _LATENCY_SIGMA_PER_JITTER * jitter)
