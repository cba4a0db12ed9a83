# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images for RTAB-Map, which takes them for rectified."""

import dataclasses
from types import SimpleNamespace

import numpy as np

from aick_ros.frames.rectification import rectified
from aick_ros.messages.camera_info import to_camera
from aick_ros.messages.raw_image import decode_colour, decode_depth
from aick_ros.ros.output import rgbd_image


def test_images_of_a_camera_with_distortion_are_rectified(monkeypatch, source):
    monkeypatch.setattr(rgbd_image, 'RGBDImage', SimpleNamespace)
    frame = source.frame(0)
    camera = dataclasses.replace(frame.camera, distortion=(-0.2, 0.05, 0.0, 0.0, 0.0))
    message = rgbd_image.rgbd_image(dataclasses.replace(frame, camera=camera), 'optical')
    for info in (message.rgb_camera_info, message.depth_camera_info):
        assert to_camera(info) == to_camera(info, rectified=True) == frame.camera
    expected = rectified(dataclasses.replace(frame, camera=camera))
    colour, depth = decode_colour(message.rgb), decode_depth(message.depth)
    np.testing.assert_array_equal(colour, expected.colour)
    np.testing.assert_array_equal(depth, expected.depth)
    assert (colour != frame.colour).any()
