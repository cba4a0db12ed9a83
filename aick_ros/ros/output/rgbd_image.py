# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame as RTAB-Map reads it: colour, depth and calibration in one message."""

from __future__ import annotations

from array import array

import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages.raw_image import ImageFields, encode_colour, encode_depth
from aick_ros.ros import conversions
from aick_ros.ros.rtabmap_messages import RGBDImage


def rgbd_image(frame: RgbdFrame, camera_frame: str) -> RGBDImage:
    """
    Return the message of a frame, its depth in metres and in the image of the colour camera.

    Both images are rectified, as RTAB-Map expects them.

    :param camera_frame: frame of the images.
    """
    frame = rectified(frame)
    header = conversions.header(frame.stamp, camera_frame)
    depth_header = conversions.header(
        frame.stamp if frame.depth_stamp is None else frame.depth_stamp, camera_frame)
    return RGBDImage(
        header=header, rgb=_image(header, encode_colour(frame.colour)),
        depth=_image(depth_header, encode_depth(frame.depth)),
        rgb_camera_info=_camera_info(header, frame.camera),
        depth_camera_info=_camera_info(depth_header, frame.camera))


def _image(header: Header, fields: ImageFields) -> Image:
    return Image(header=header, height=fields.height, width=fields.width,
                 encoding=fields.encoding, is_bigendian=fields.is_bigendian, step=fields.step,
                 data=array('B', fields.data.tobytes()))


def _camera_info(header: Header, camera: Camera) -> CameraInfo:
    return CameraInfo(
        header=header, width=camera.width, height=camera.height, k=camera.matrix.ravel(),
        distortion_model='plumb_bob', d=[0.0] * 5, r=np.eye(3).ravel(),
        p=np.hstack([camera.matrix, np.zeros((3, 1))]).ravel())
