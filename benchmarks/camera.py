# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A camera in a process of its own: rendered frames at a steady rate, stamped when published.

    python benchmarks/camera.py FRAMES.npz --rate 30 --seconds 60

FRAMES.npz has ``colour`` (N x H x W x 3 uint8), ``depth`` (N x H x W uint16 millimetres) and
``k``. They are shown to and fro, so that the view never jumps. They are sent raw, or as JPEG and
PNG where ``--compressed`` is given. The number of frames published is printed at the end.
"""

from __future__ import annotations

import argparse
import sys
import time
from array import array
from dataclasses import dataclass

import cv2
import numpy as np
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from aick_ros.ros.conversions import header
from aick_ros.ros.process.program import program
from aick_ros.ros.process.resources import use_fastdds_profile

FRAME = 'camera_optical_frame'
_PATIENCE = 120.0  # seconds until a node has started, on a busy machine, and is found


@dataclass(frozen=True)
class Play:
    """
    How frames are published.

    :param at_once: do not wait for a listener.
    :param clock_offset: of this host's clock [s].
    """

    rate: float = 30.0
    seconds: float = 60.0
    at_once: bool = False
    compressed: bool = False
    best_effort: bool = False
    clock_offset: float = 0.0


def image_message(pixels: np.ndarray, encoding: str) -> Image:
    """Return an image without stamp."""
    return Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                 step=pixels.strides[0], data=array('B', pixels.tobytes()))


def compressed_message(pixels: np.ndarray, extension: str, form: str) -> CompressedImage:
    """Return an image as image_transport compresses it, without stamp."""
    return CompressedImage(
        format=form, data=array('B', cv2.imencode(extension, pixels)[1].tobytes()))


def to_and_fro(count: int) -> list[int]:
    """Return the indices of one round that ends beside where it began."""
    return [*range(count), *range(count - 2, 0, -1)]


def main() -> None:
    """Publish until the time is over or a signal ends it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('frames')
    parser.add_argument('--rate', type=float, default=30.0)
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--at-once', action='store_true', help='do not wait for a listener')
    parser.add_argument('--compressed', action='store_true')
    parser.add_argument('--best-effort', action='store_true')
    parser.add_argument('--clock-offset', type=float, default=0.0, help='of its stamps [s]')
    parser.add_argument('--stamps', help='file (.npy) of the stamps of the frames published [ns]')
    arguments = vars(parser.parse_args())
    recording, file = np.load(arguments.pop('frames')), arguments.pop('stamps')
    with program('camera', use_fastdds_profile, interrupt=True):
        stamps = play(recording, Play(**arguments))
        print(len(stamps))
        if file:
            np.save(file, stamps)


def play(recording: dict[str, np.ndarray], how: Play) -> list[int]:
    """Publish frames; return their stamps [ns]."""
    node = rclpy.create_node('camera')
    qos = QoSProfile(depth=10)
    if how.best_effort:
        qos.reliability = ReliabilityPolicy.BEST_EFFORT
    kind, suffix = (CompressedImage, '/compressed') if how.compressed else (Image, '')
    publishers = [node.create_publisher(*topic, qos) for topic in (
        (kind, f'rgb/image{suffix}'), (kind, f'depth/image{suffix}'),
        (CameraInfo, 'rgb/camera_info'))]
    frames = [_messages(colour, depth, how.compressed)
              for colour, depth in zip(recording['colour'], recording['depth'])]
    height, width = recording['depth'].shape[1:]
    camera_info = CameraInfo(width=width, height=height, k=recording['k'].ravel(),
                             distortion_model='plumb_bob', d=[0.0] * 5)
    deadline = time.monotonic() + _PATIENCE
    while not (how.at_once or all(
            publisher.get_subscription_count() for publisher in publishers)):
        if time.monotonic() > deadline:
            sys.exit('camera: nobody listens')
        time.sleep(0.01)
    time.sleep(1.0)  # until the node's endpoints know ours too
    order = to_and_fro(len(frames))
    start, stamps = time.monotonic(), []
    for i in range(round(how.rate * how.seconds)):
        time.sleep(max(0.0, start + i / how.rate - time.monotonic()))
        stamps.append(time.time_ns() + round(1e9 * how.clock_offset))
        stamped = header(stamps[-1], FRAME)
        for message, publisher in zip((*frames[order[i % len(order)]], camera_info), publishers):
            message.header = stamped
            publisher.publish(message)
    time.sleep(1.0)
    return stamps


def _messages(colour: np.ndarray, depth: np.ndarray, compressed: bool
              ) -> tuple[Image | CompressedImage, Image | CompressedImage]:
    if not compressed:
        return image_message(colour, 'rgb8'), image_message(depth, '16UC1')
    return (compressed_message(colour[..., ::-1], '.jpg', 'rgb8; jpeg compressed bgr8'),
            compressed_message(depth, '.png', '16UC1; png compressed '))


if __name__ == '__main__':
    main()
