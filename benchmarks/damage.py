# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages that a camera should never send, of every kind, at random."""

from __future__ import annotations

from array import array

import numpy as np
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

_ENCODINGS = ('rgb8', 'bgr8', 'mono8', 'mono16', '16UC1', '32FC1', 'yuv422', 'bayer_rggb8',
              'bayer_grbg16', '8UC1', '8UC3', 'rgb17', '', 'jpeg', 'utf-\u00fc')
_FORMATS = ('png', 'jpeg', 'rgb8; jpeg compressed bgr8', '16UC1; compressedDepth',
            '16UC1; compressedDepth png', '16UC1; compressedDepth rvl',
            '32FC1; compressedDepth rvl', '')


class Damage:
    """
    Draws damaged messages.

    :param good: a colour and a depth image as they should be, and their camera_info.
    """

    def __init__(self, good: tuple[Image, Image, CameraInfo], seed: int = 0) -> None:
        self._colour, self._depth, self._info = good
        self._rng = np.random.default_rng(seed)

    def image(self, good: Image) -> Image:
        """Return an image with a wrong size, step, encoding or data, or without any depth."""
        draw = self._rng.integers
        message = Image(height=good.height, width=good.width, encoding=good.encoding,
                        step=good.step, is_bigendian=int(draw(0, 256)),
                        data=array('B', self._bytes(draw(0, 3000))))
        kind = draw(0, 5)
        if kind == 0:
            message.height, message.width = (int(n) for n in draw(0, 2 ** 32, 2))
        elif kind == 1:
            message.step = int(draw(0, 2 ** 32))
        elif kind == 2:
            message.encoding = str(self._rng.choice(_ENCODINGS))
        elif kind == 3:  # consistent, but of another size than the camera
            height, width = (int(n) for n in draw(1, 40, 2))
            message = Image(height=height, width=width, encoding='32FC1', step=4 * width,
                            data=array('B', np.full((height, width), np.nan, '<f4').tobytes()))
        elif draw(0, 100) == 0:  # seldom, for it is large: nothing but NaN
            fill = np.full((good.height, good.width), np.nan, '<f4')
            message = Image(height=good.height, width=good.width, encoding='32FC1',
                            step=4 * good.width, data=array('B', fill.tobytes()))
        return message

    def pair(self) -> tuple[Image, Image]:
        """Return a colour and a depth image of which at least one is damaged."""
        which = self._rng.integers(0, 3)
        return (self._colour if which == 0 else self.image(self._colour),
                self._depth if which == 1 else self.image(self._depth))

    def compressed_pair(self, good: tuple[CompressedImage, CompressedImage]
                        ) -> tuple[CompressedImage, CompressedImage]:
        """Return two compressed images of random bytes, or with some bytes changed."""
        return tuple(self._compressed(message) for message in good)

    def camera_info(self) -> CameraInfo:
        """Return a camera_info that is not one."""
        info = CameraInfo(width=self._info.width, height=self._info.height, k=self._info.k,
                          distortion_model='plumb_bob', d=[0.0] * 5)
        kind = self._rng.integers(0, 5)
        if kind == 0:
            info.k = np.zeros(9)
        elif kind == 1:
            info.k = np.full(9, np.nan)
        elif kind == 2:
            info.d = [np.inf] * 5
        elif kind == 3:
            info.d = [0.1] * 3
        else:
            info.distortion_model = 'imaginary'
            info.d = [0.1] * 7
        return info

    def _compressed(self, good: CompressedImage) -> CompressedImage:
        data = np.frombuffer(self._bytes(self._rng.integers(0, 2000)), np.uint8)
        if self._rng.integers(0, 50) == 0:  # as from a bad cable
            data = np.array(good.data)
            data[self._rng.integers(0, len(data), 20)] ^= 255
            data = data[:self._rng.integers(1, len(data))]
        elif self._rng.integers(0, 2):  # a good beginning
            data = np.concatenate([np.array(good.data[:64]), data])
        kind = good.format if self._rng.integers(0, 2) else str(self._rng.choice(_FORMATS))
        return CompressedImage(format=kind, data=array('B', data.tobytes()))

    def _bytes(self, count: int) -> bytes:
        return self._rng.integers(0, 256, int(count), np.uint8).tobytes()
