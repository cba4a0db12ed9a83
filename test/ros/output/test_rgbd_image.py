# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images for RTAB-Map, which takes them for rectified."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import to_camera
from aick_ros.messages.raw_image import decode_colour, decode_depth
from aick_ros.ros.conversions import header
from aick_ros.ros.output import rgbd_image


@pytest.fixture
def images(rtabmap_types, monkeypatch):
    """Let there be the message of RTAB-Map."""
    monkeypatch.setattr(rgbd_image, 'RGBDImage', rtabmap_types['RGBDImage'])


def test_images_of_a_camera_with_distortion_are_rectified(images, source):
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


@pytest.mark.parametrize('later', [None, 0, 7_000_000])
def test_every_part_has_the_stamp_of_its_image_and_the_frame_of_colour(images, later):
    stamp, camera = 5_000_000_007, Camera(8, 6, 10.0, 11.0, 3.5, 2.5)
    depth_stamp = None if later is None else stamp + later
    message = rgbd_image.rgbd_image(
        RgbdFrame(stamp, np.zeros((6, 8, 3), np.uint8), np.full((6, 8), 2.5, np.float32), camera,
                  depth_stamp), 'optical')
    for part, of_depth in (
            (message, False), (message.rgb, False), (message.rgb_camera_info, False),
            (message.depth, True), (message.depth_camera_info, True)):
        assert part.header == header(stamp + (later or 0) * of_depth, 'optical')
    assert (message.rgb.encoding, message.depth.encoding) == ('rgb8', '32FC1')
    for image, size in ((message.rgb, 3), (message.depth, 4)):
        assert (image.height, image.width, image.step) == (6, 8, 8 * size)
    for info in (message.rgb_camera_info, message.depth_camera_info):
        assert (info.height, info.width, info.distortion_model) == (6, 8, 'plumb_bob')
        assert list(info.d) == [0.0] * 5
