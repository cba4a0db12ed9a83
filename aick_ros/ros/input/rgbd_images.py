# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Colour, depth and their calibrations in one message, as rgbd_sync of RTAB-Map sends them."""

from __future__ import annotations

from functools import partial
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Header

from aick_ros.errors import InputError
from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.input.assembler import FrameAssembler
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.subscriptions import AdaptiveSubscription, image_topics
from aick_ros.ros.rtabmap_messages import INSTALL_RTABMAP_MSGS, RGBDImage, RGBDImages
from aick_ros.settings.node import NodeSettings


def require_messages(settings: NodeSettings) -> None:
    """
    Check that what the settings need is installed.

    :raises InputError: where rtabmap_msgs is not.
    """
    if settings.subscribe_rgbd and RGBDImage is None:
        raise InputError('subscribe_rgbd is true, and rtabmap_msgs is not installed: '
                         f'{INSTALL_RTABMAP_MSGS}, or set subscribe_rgbd to false')


def rgbd_subscription(node: Node, settings: NodeSettings, assembler: FrameAssembler,
                      pairing: Pairing) -> AdaptiveSubscription:
    """Subscribe to the images of the first camera, as ``rgbd_cameras`` says how they are sent."""
    name, _ = image_topics(settings)
    if settings.rgbd_cameras > 1:
        node.get_logger().warning(f'rgbd_cameras = {settings.rgbd_cameras}: only the first '
                                  f'camera is used, on {name}')
    take = partial(_take, name, assembler, pairing)
    if settings.rgbd_cameras == 0:
        return AdaptiveSubscription(node, RGBDImages, name, partial(_take_first, node, take),
                                    settings.topic_queue_size, settings.qos_reliability)
    return AdaptiveSubscription(node, RGBDImage, name, take, settings.topic_queue_size,
                                settings.qos_reliability)


def _take_first(node: Node, take: Any, message: Any) -> None:
    images = message.rgbd_images
    if len(images) != 1:
        node.get_logger().warning(f'rgbd_images has {len(images)} images: only the first is used',
                                  once=True)
    take(images[0] if images else RGBDImage(header=message.header))


def _take(name: str, assembler: FrameAssembler, pairing: Pairing, message: Any) -> None:
    try:
        colour = _image('colour', message.rgb, message.rgb_compressed, message.header)
        depth = _image('depth', message.depth, message.depth_compressed, message.header)
    except InputError as error:
        pairing.reject(name, str(error))
        return
    assembler.take_camera_infos(message.rgb_camera_info, message.depth_camera_info)
    pairing.take_pair(Pair(to_stamp(colour.header.stamp), colour,
                           to_stamp(depth.header.stamp), depth))


def _image(kind: str, raw: Any, compressed: Any, header: Header) -> Any:
    """Return what a message contains of a kind, with the header of the message if it has none."""
    image = raw if len(raw.data) else compressed
    if not len(image.data):
        raise InputError(f'it has no {kind} image; its publisher must send one, raw or compressed')
    if to_stamp(image.header.stamp) == 0:
        image.header = header
    return image
