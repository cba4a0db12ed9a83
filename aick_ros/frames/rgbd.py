# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""RGB-D frame: a colour image with its registered depth image."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.borders.limits import MAX_DEPTH, MIN_DEPTH
from aick_ros.borders.values import required, whole_number
from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.camera import Camera


@dataclass(frozen=True, eq=False)
class RgbdFrame:
    """
    Colour image with its registered depth image.

    :param stamp: stamp of the colour image [ns].
    :param colour: HxWx3 (red, green, blue) or HxW uint8.
    :param depth: HxW float32, z in the optical frame of the colour camera [m]; NaN, infinite, zero
        or negative where invalid. Whoever keeps a frame copies its images: their arrays may be
        filled again, unless they are handed over.
    :param camera: calibration of the colour camera.
    :param depth_stamp: stamp of the depth image [ns]; None: that of the colour image.
    :param imu: samples of an IMU since the frame before, in the axes of the optical frame; None:
        there is none.
    :raises InputError: if the images do not fit each other or the camera.
    """

    stamp: int
    colour: np.ndarray
    depth: np.ndarray
    camera: Camera
    depth_stamp: int | None = None
    imu: ImuSamples | None = None

    def __post_init__(self) -> None:
        """Reject images of wrong type or size, and stamps that are not whole nanoseconds."""
        self._check_types()
        if self.colour.dtype != np.uint8 or not _is_image(self.colour):
            raise InputError(f'the colour image is {self.colour.dtype} of shape '
                             f'{self.colour.shape}: uint8 of shape HxW or HxWx3 is required')
        if self.depth.dtype != np.float32 or self.depth.ndim != 2:
            raise InputError(f'the depth image is {self.depth.dtype} of shape '
                             f'{self.depth.shape}: float32 of shape HxW, in metres, is required')
        size, camera = self.colour.shape[:2], (self.camera.height, self.camera.width)
        if self.depth.shape != size:
            raise InputError(
                f'colour is {size[1]} x {size[0]} and depth {self.depth.shape[1]} x '
                f'{self.depth.shape[0]} pixels: depth must be registered to the colour camera')
        if size != camera:
            raise InputError(
                f'colour is {size[1]} x {size[0]} pixels and the camera calibrated for '
                f'{camera[1]} x {camera[0]}: the calibration must be of the same resolution')

    def _check_types(self) -> None:
        for name, image in (('colour', self.colour), ('depth', self.depth)):
            if not isinstance(image, np.ndarray):
                raise InputError(f'the {name} image is a {type(image).__name__}: a NumPy array is '
                                 'required')
        required(self.camera, Camera, 'the camera')
        whole_number(self.stamp, 'the stamp [ns] of the colour image')
        if self.depth_stamp is not None:
            whole_number(self.depth_stamp, 'the stamp [ns] of the depth image')
        if self.imu is not None:
            required(self.imu, ImuSamples, 'imu')

    def handed_over(self) -> RgbdFrame:
        """Return the frame itself, whose images are constant from now on: nobody changes them."""
        self.colour.flags.writeable = self.depth.flags.writeable = False
        return self

    def owned(self) -> RgbdFrame:
        """
        Return the frame with images that nobody can change, and depth that can be, or is NaN.

        Those that are not constant are copied: many cameras write the next images over these ones.
        """
        colour = self.colour if _is_constant(self.colour) else np.array(self.colour, order='C')
        depth = self.depth if _is_constant(self.depth) and _is_valid(self.depth) else _valid(
            self.depth)
        if colour is self.colour and depth is self.depth:
            return self
        return dataclasses.replace(self, colour=colour, depth=depth).handed_over()

    @cached_property
    def grey(self) -> np.ndarray:
        """The colour image in grey, HxW uint8."""
        return grey_of(self.colour)


def grey_of(colour: np.ndarray) -> np.ndarray:
    """Return a colour image in grey, HxW uint8, which is that one where it has no colours."""
    if colour.ndim == 2:
        return colour
    grey = cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY)
    grey.flags.writeable = False
    return grey


def _is_constant(image: np.ndarray) -> bool:
    """Return whether an array has memory of its own, row by row, that nobody writes to."""
    return image.base is None and image.flags.c_contiguous and not image.flags.writeable


def _is_valid(depth: np.ndarray) -> bool:
    """Return whether all depths are NaN, or such that a camera may measure."""
    return not depth.size or kernels.is_valid_depth(depth, MIN_DEPTH, MAX_DEPTH)


def _valid(depth: np.ndarray) -> np.ndarray:
    """Return a copy of a depth image, NaN instead of what no camera measures."""
    valid = np.empty(depth.shape, np.float32)
    if depth.size:
        kernels.valid_depth(depth, MIN_DEPTH, MAX_DEPTH, valid)
    return valid


def _is_image(array: np.ndarray) -> bool:
    return array.ndim == 2 or array.ndim == 3 and array.shape[2] == 3
