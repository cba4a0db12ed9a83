# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Colour and depth messages, live or recorded, to RGB-D frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import stamp_to_seconds
from aick_ros.messages import compressed_image, raw_image
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.depth_scaling import enlarge
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.messages.synchronizer import Pair

_FAR = 1.0  # [m]; chosen: no device with both cameras is that wide


class FrameDecoder:
    """
    Makes RGB-D frames of pairs of messages, each a sensor_msgs/Image or a CompressedImage.

    :param names: of the colour and the depth images in error messages.
    :param register_depth: in error messages, what to set so that depth is registered.
    """

    def __init__(self, names: tuple[str, str] = ('colour', 'depth'),
                 register_depth: str = 'register_depth') -> None:
        self._colour_name, self._depth_name = names
        self._register_depth = register_depth
        self._bits = BitDepth()
        self._reprojections: dict[tuple[Camera, Camera, bytes], DepthToColour] = {}

    def decode(self, pair: Pair, camera: Camera) -> RgbdFrame:
        """
        Return the frame of a pair whose depth is in the image of the colour camera already.

        Depth images that are smaller by a whole factor are enlarged.

        :param camera: the colour camera.
        :raises InputError: where the images cannot be used, naming the image and its stamp.
        """
        colour, depth = self._images(pair)
        try:
            height, width = colour.shape[:2]
            return RgbdFrame(pair.colour_stamp, colour,
                             enlarge(depth, width, height, self._register_depth), camera,
                             pair.depth_stamp).handed_over()
        except InputError as error:
            raise _named(self._colour_name, pair.colour_stamp, error) from None

    def decode_and_reproject(self, pair: Pair, camera: Camera, depth_camera: Camera,
                             T_colour_depth: np.ndarray) -> RgbdFrame:
        """
        Return the frame of a pair whose depth is in the image of its own depth camera.

        :param camera: the colour camera.
        :param T_colour_depth: 4x4, from the depth to the colour camera's optical frame.
        :raises InputError: where the images cannot be used, naming the image and its stamp.
        """
        colour, depth = self._images(pair)
        _require_size(self._colour_name, pair.colour_stamp, colour, camera)
        _require_size(self._depth_name, pair.depth_stamp, depth, depth_camera)
        registered = self._reprojection(depth_camera, camera, T_colour_depth).reproject(depth)
        distance = float(np.linalg.norm(T_colour_depth[:3, 3]))
        if distance > _FAR and np.isnan(registered).all() and np.any(depth > 0.0):
            raise _named(self._depth_name, pair.depth_stamp, InputError(
                'no depth falls into the colour image, as by its pose the depth camera is '
                f'{distance:.3g} m from the colour camera: check that the pose is in metres'))
        return RgbdFrame(pair.colour_stamp, colour, registered, camera,
                         pair.depth_stamp).handed_over()

    def _reprojection(self, depth_camera: Camera, camera: Camera,
                      T_colour_depth: np.ndarray) -> DepthToColour:
        """Return the latest reprojection, or a new one where anything has changed."""
        key = depth_camera, camera, T_colour_depth.tobytes()
        if key not in self._reprojections:
            self._reprojections = {key: DepthToColour(depth_camera, camera, T_colour_depth)}
        return self._reprojections[key]

    def _images(self, pair: Pair) -> tuple[np.ndarray, np.ndarray]:
        """Return colour, HxWx3 or HxW uint8, and depth, HxW float32 [m]."""
        return (_decoded(self._colour_name, pair.colour_stamp, self._decode_colour, pair.colour),
                _decoded(self._depth_name, pair.depth_stamp, _decode_depth, pair.depth))

    def _decode_colour(self, message: Any) -> np.ndarray:
        if _is_raw(message):
            return raw_image.decode_colour(message, self._bits)
        return compressed_image.decode_colour(message, self._bits)


def _decode_depth(message: Any) -> np.ndarray:
    if _is_raw(message):
        return raw_image.decode_depth(message)
    return compressed_image.decode_depth(message)


def _is_raw(message: Any) -> bool:
    """Return whether a message is an Image; a CompressedImage has no encoding but a format."""
    return hasattr(message, 'encoding')


def _decoded(name: str, stamp: int, decode: Callable[[Any], np.ndarray],
             message: Any) -> np.ndarray:
    try:
        return decode(message)
    except InputError as error:
        raise _named(name, stamp, error) from None


def _require_size(name: str, stamp: int, image: np.ndarray, camera: Camera) -> None:
    height, width = image.shape[:2]
    if (width, height) != (camera.width, camera.height):
        raise _named(name, stamp, InputError(
            f'the image is {width} x {height} pixels and its camera calibrated for '
            f'{camera.width} x {camera.height}: use the camera_info of this image'))


def _named(name: str, stamp: int, error: InputError) -> InputError:
    """Return an error that says which image it is about."""
    return InputError(f'{name} at {stamp_to_seconds(stamp)}: {error}')
