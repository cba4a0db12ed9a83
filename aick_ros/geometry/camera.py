# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pinhole camera with the distortion models of sensor_msgs/CameraInfo."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.borders.limits import (
    MAX_DISTORTION, MAX_PIXEL_LENGTH, MAX_PIXELS, MAX_SIDE, MIN_FOCAL_LENGTH)
from aick_ros.borders.names import quoted
from aick_ros.borders.values import numbers, required
from aick_ros.errors import InputError
from aick_ros.geometry.se3 import exp_rotation

DISTORTION_MODELS = {
    'plumb_bob': (0, 4, 5),
    'rational_polynomial': (0, 8, 12, 14),
    'equidistant': (4,),
}
"""Model name -> allowed numbers of coefficients; 0: no distortion."""

_COEFFICIENTS = 12  # of a rational polynomial; behind them is the tilt of the sensor
_POLYNOMIAL, _TILTED, _EQUIDISTANT = range(3)  # kinds of lenses, as the kernels number them
_MAX_SKEW = 1.0  # px on the plane z = 1; chosen: a larger one displaces points by half a pixel
_IDENTITY = 1.0, 1.0, 0.0, 0.0  # fx, fy, cx, cy of a matrix that nobody has filled in
_SCALES = 0.0, 1.0  # of an intrinsic matrix; drivers that leave it out send 0
_FEWEST_RAYS = 1 / 3  # share of pixels; chosen: wide lenses have 0.58, wrong coefficients 0.19
_CHECKED = 9  # columns and rows of pixels that are checked for it; chosen
_MAX_ROUND_TRIP_ERROR = 0.1  # px; chosen: a larger error means that undistortion failed
_UNDISTORT_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-9)  # chosen


@dataclass(frozen=True)
class Camera:
    """
    Calibrated camera.

    :param width: image columns [px].
    :param height: image rows [px].
    :param fx: focal length [px]; fy, cx, cy likewise (``k`` of CameraInfo).
    :param distortion_model: a key of :data:`DISTORTION_MODELS`.
    :param distortion: coefficients of the model (``d`` of CameraInfo); empty: no distortion.
    :raises InputError: if a value is invalid.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion_model: str = 'plumb_bob'
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Reject invalid values; sizes become int, the coefficients a tuple."""
        self._check_types()
        intrinsics = (self.fx, self.fy, self.cx, self.cy)
        if not all(map(math.isfinite, intrinsics)) or self.fx <= 0 or self.fy <= 0:
            raise InputError(
                f'the camera has fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}: '
                'all must be finite, and focal lengths must be positive; calibrate the camera')
        focal_lengths = (self.fx, self.fy)
        if max(map(abs, intrinsics)) > MAX_PIXEL_LENGTH or min(focal_lengths) < MIN_FOCAL_LENGTH:
            raise InputError(
                f'the camera has fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}: '
                f'focal lengths must be from {MIN_FOCAL_LENGTH:g} to {MAX_PIXEL_LENGTH:g} pixels, '
                f'cx and cy at most {MAX_PIXEL_LENGTH:g}; calibrate the camera')
        if self.width <= 0 or self.height <= 0:
            raise InputError(f'the camera image has {self.width} x {self.height} pixels: '
                             'width and height must be positive')
        if max(self.width, self.height) > MAX_SIDE or self.width * self.height > MAX_PIXELS:
            raise InputError(f'the camera image has {self.width} x {self.height} pixels: at most '
                             f'{MAX_SIDE} on a side and {MAX_PIXELS} in all are supported')
        self._check_distortion()

    def _check_types(self) -> None:
        try:
            width, height = operator.index(self.width), operator.index(self.height)
            for number in (self.fx, self.fy, self.cx, self.cy):
                math.isfinite(number)
            distortion = tuple(float(coefficient) for coefficient in self.distortion)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f'the camera is not of numbers ({error}): width and height must be '
                             'whole numbers, focal lengths, centre and coefficients numbers'
                             ) from None
        for name, value in (('width', width), ('height', height), ('distortion', distortion)):
            object.__setattr__(self, name, value)

    def _check_distortion(self) -> None:
        if str(self.distortion_model) not in DISTORTION_MODELS:
            raise InputError(
                f'unknown distortion model {quoted(self.distortion_model)}: supported are '
                + ', '.join(DISTORTION_MODELS))
        counts = DISTORTION_MODELS[self.distortion_model]
        if len(self.distortion) not in counts:
            raise InputError(
                f'distortion model {self.distortion_model} has {len(self.distortion)} '
                f'coefficients: it must have {" or ".join(map(str, counts))}')
        # not <= is true for NaN
        if not all(abs(coefficient) <= MAX_DISTORTION for coefficient in self.distortion):
            raise InputError(f'the distortion coefficients {self.distortion} are not all finite '
                             f'and at most {MAX_DISTORTION:g}: calibrate the camera')

    def _check_lens(self) -> None:
        """Reject coefficients with which most pixels have no ray in front of the camera."""
        share = _share_with_rays(self)
        if share < _FEWEST_RAYS:
            coefficients = ', '.join(f'{coefficient:g}' for coefficient in self.distortion)
            raise InputError(
                f'd of camera_info is [{coefficients}], with which only {share:.0%} of the pixels '
                f'have a ray: check that it is in the order of {self.distortion_model} and '
                'belongs to k, or calibrate the camera')

    @classmethod
    def from_camera_info(cls, width: int, height: int, k: Sequence[float] | np.ndarray,
                         d: Sequence[float] = (), distortion_model: str = '') -> Camera:
        """
        Return the camera described by the fields of a sensor_msgs/CameraInfo.

        :param k: 3x3 intrinsic matrix, row-major: nine numbers, or an array of shape 3x3.
        :param d: distortion coefficients; all zero: no distortion.
        :param distortion_model: a key of :data:`DISTORTION_MODELS`; empty: plumb_bob.
        :raises InputError: if a field is invalid, for example ``k`` all zero (not calibrated).
        """
        try:
            k, d = _rows(k), [float(number) for number in d]
            width, height = int(width), int(height)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f'camera_info is not of numbers ({error}): required are width and '
                             'height, and the lists k and d') from None
        if len(k) != 9:
            raise InputError(f'k of camera_info has {len(k)} numbers: 9 are required, row by row')
        if k[0] == 0.0:
            raise InputError('camera_info is not calibrated: k[0] is 0; calibrate the camera or '
                             'start its driver with a calibration file')
        if not _is_intrinsic(k):
            raise InputError(f'k of camera_info is [{", ".join(f"{number:g}" for number in k)}]: '
                             'it must be fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row; check the '
                             'driver')
        if (k[0], k[4], k[2], k[5]) == _IDENTITY:
            raise InputError('camera_info is not calibrated: its matrix is the identity; '
                             'calibrate the camera or start its driver with a calibration file')
        model = required(distortion_model, str, 'distortion_model') or 'plumb_bob'
        distortion = tuple(d)
        if model == 'equidistant':
            distortion = distortion or (0.0,) * 4  # an equidistant projection all the same
        elif not any(distortion):
            distortion = ()
        camera = cls(width, height, k[0], k[4], k[2], k[5], model, distortion)
        camera._check_lens()
        return camera

    @property
    def matrix(self) -> np.ndarray:
        """Intrinsic matrix, 3x3 float64."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], np.float64)

    def normalize(self, pixels: np.ndarray) -> np.ndarray:
        """
        Return the undistorted coordinates of pixels on the plane z = 1.

        :param pixels: Nx2 (u, v) in the distorted image [px].
        :returns: Nx2 float64; NaN where the distortion model has no ray in front of the camera.
        :raises InputError: where these are no pixels.
        """
        pixels = numbers(pixels, (None, 2), 'pixels')
        if self._kind != _POLYNOMIAL:
            return self._normalized_by_opencv(pixels)
        rays = np.empty((len(pixels), 2))
        kernels.normalize(pixels, self.model, rays)
        return rays

    def _normalized_by_opencv(self, pixels: np.ndarray) -> np.ndarray:
        if not len(pixels):
            return np.empty((0, 2))
        undistort = (cv2.fisheye.undistortPoints if self.distortion_model == 'equidistant'
                     else _undistort)
        normalized = np.asarray(undistort(pixels.reshape(-1, 1, 2), self.matrix,
                                          np.array(self.distortion))).reshape(-1, 2)
        reprojected = self.project(np.column_stack([normalized, np.ones(len(normalized))]))
        error = np.abs(reprojected - pixels).max(axis=1)
        return np.where((error < _MAX_ROUND_TRIP_ERROR)[:, None], normalized, np.nan)

    def back_project(self, pixels: np.ndarray, depths: np.ndarray) -> np.ndarray:
        """
        Return the points at pixels with given depths, in the optical frame (REP-103).

        :param pixels: Nx2 (u, v) [px].
        :param depths: N, z of the points [m].
        :returns: Nx3 float64 [m]; NaN where a pixel has no ray.
        :raises InputError: where these are no pixels, or the depths not as many.
        """
        pixels = numbers(pixels, (None, 2), 'pixels')
        depths = numbers(depths, (len(pixels),), 'depths')
        return np.column_stack([self.normalize(pixels) * depths[:, None], depths])

    def project(self, points: np.ndarray) -> np.ndarray:
        """
        Return the pixels onto which points project.

        :param points: Nx3 in the optical frame [m], z > 0; the pixels of others mean nothing.
        :returns: Nx2 float64 (u, v) [px]; may lie outside the image.
        :raises InputError: where these are no points.
        """
        points = numbers(points, (None, 3), 'points')
        pixels = np.empty((len(points), 2))
        kernels.project(points, self.model, pixels)
        return pixels

    @functools.cached_property
    def model(self) -> np.ndarray:
        """
        The camera as the kernels take it, 28.

        It has fx, fy, cx, cy, twelve coefficients of the distortion, the 3x3 matrix of the tilt
        of the sensor, the kind of the lens, and the width and height of the image.
        """
        coefficients, tilt = self.distortion[:_COEFFICIENTS], self.distortion[_COEFFICIENTS:]
        missing = _COEFFICIENTS - len(coefficients)
        return np.array([self.fx, self.fy, self.cx, self.cy, *coefficients, *missing * (0.0,),
                         *_tilt(*tilt or (0.0, 0.0)).ravel(), self._kind, self.width,
                         self.height])

    @functools.cached_property
    def _kind(self) -> int:
        """The kind of the lens, as the kernels number it."""
        if self.distortion and self.distortion_model == 'equidistant':
            return _EQUIDISTANT
        return _TILTED if any(self.distortion[_COEFFICIENTS:]) else _POLYNOMIAL


def _tilt(about_x: float, about_y: float) -> np.ndarray:
    """Return what a sensor that is tilted, about x and then about y [rad], does to (u, v, 1)."""
    rotation = exp_rotation((0.0, -about_y, 0.0)) @ exp_rotation((-about_x, 0.0, 0.0))
    along_rays = np.diag([rotation[2, 2], rotation[2, 2], 1.0])
    along_rays[:2, 2] = -rotation[:2, 2]
    tilt: np.ndarray = along_rays @ rotation
    return tilt


def _undistort(pixels: np.ndarray, matrix: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Undistort to convergence; the five iterations of OpenCV's default are too few at corners."""
    if hasattr(cv2, 'undistortPointsIter'):  # OpenCV 4
        return np.asarray(cv2.undistortPointsIter(
            pixels, matrix, distortion, None, None, _UNDISTORT_CRITERIA))
    return np.asarray(
        cv2.undistortPoints(pixels, matrix, distortion, criteria=_UNDISTORT_CRITERIA))


def _rows(k: Sequence[float] | np.ndarray) -> list[float]:
    """Return the numbers of a matrix, row by row: of one that is not 3x3 as they are given."""
    return [float(number) for number in (np.ravel(k) if np.shape(k) == (3, 3) else k)]


def _is_intrinsic(k: Sequence[float]) -> bool:
    """Return whether a 3x3 matrix, row by row, is that of a camera, its skew aside if small."""
    return abs(k[1]) <= _MAX_SKEW and not any((k[3], k[6], k[7])) and k[8] in _SCALES


@functools.lru_cache(maxsize=16)  # a driver sends the same camera with each image
def _share_with_rays(camera: Camera) -> float:
    """Return the share of pixels that have a ray in front of a camera."""
    columns, rows = (np.linspace(0, side - 1, _CHECKED) for side in (camera.width, camera.height))
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    return float(np.isfinite(camera.normalize(pixels)[:, 0]).mean())
