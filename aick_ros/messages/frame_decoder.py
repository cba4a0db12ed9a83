# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Colour and depth messages to frames: decoded, of one size, seen by one camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages import compressed_image, raw_image
from aick_ros.messages.depth_scaling import enlarge
from aick_ros.messages.depth_to_colour import DepthRegistration
from aick_ros.messages.synchronizer import Pair


class FrameDecoder:
    """
    Makes frames of pairs of messages.

    :param image_transport: of the colour images, ``raw`` or ``compressed``.
    :param depth_transport: of the depth images, ``raw``, ``compressed`` or ``compressedDepth``.
    """

    def __init__(self, image_transport: str = 'raw', depth_transport: str = 'raw') -> None:
        self._colour = (raw_image.colour_image if image_transport == 'raw'
                        else compressed_image.compressed_colour)
        self._depth = (raw_image.depth_image if depth_transport == 'raw'
                       else compressed_image.compressed_depth)
        self._registration: DepthRegistration | None = None
        self._registered_by: tuple[Camera, Camera, bytes] | None = None

    def decode(self, pair: Pair, camera: Camera) -> RgbdFrame:
        """
        Return the frame of images whose depth is registered to colour.

        :raises InputError: where they cannot be used.
        """
        colour, depth = self._images(pair)
        return RgbdFrame(pair.colour_stamp, colour, enlarge(depth, *colour.shape[1::-1]), camera,
                         pair.depth_stamp)

    def decode_and_register(self, pair: Pair, camera: Camera, depth_camera: Camera,
                            T_colour_depth: np.ndarray) -> RgbdFrame:
        """
        Return the frame of images of two cameras.

        :param T_colour_depth: 4x4, between their optical frames.
        :raises InputError: where they cannot be used.
        """
        colour, depth = self._images(pair)
        _require_size('colour', colour, camera)
        _require_size('depth', depth, depth_camera)
        cameras = depth_camera, camera, T_colour_depth.tobytes()
        if cameras != self._registered_by:
            self._registration = DepthRegistration(depth_camera, camera, T_colour_depth)
            self._registered_by = cameras
        return RgbdFrame(pair.colour_stamp, colour, self._registration.register(depth), camera,
                         pair.depth_stamp)

    def _images(self, pair: Pair) -> tuple[np.ndarray, np.ndarray]:
        return (_decoded('colour', self._colour, pair.colour),
                _decoded('depth', self._depth, pair.depth))


def _require_size(kind: str, image: np.ndarray, camera: Camera) -> None:
    height, width = image.shape[:2]
    if (width, height) != (camera.width, camera.height):
        raise InputError(f'{kind} is {width} x {height} pixels and its camera calibrated for '
                         f'{camera.width} x {camera.height}: take the camera_info of this image')


def _decoded(kind: str, decode: Callable[[Any], np.ndarray], message: Any) -> np.ndarray:
    try:
        return decode(message)
    except InputError as error:
        raise InputError(f'{kind}: {error}') from None
