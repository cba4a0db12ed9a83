# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A camera in a process of its own: rendered frames, raw, at a steady rate, stamped when published.

    python benchmarks/camera.py FRAMES.npz --rate 30 --seconds 60

FRAMES.npz has ``colour`` (N x H x W x 3 uint8), ``depth`` (N x H x W uint16 millimetres) and
``k``. They are shown to and fro, so that the view never jumps. The number of frames published is
printed at the end.
"""

from __future__ import annotations

import argparse
import sys
import time
from array import array

import numpy as np
import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.ros.conversions import header
from aick_ros.ros.process.program import program
from aick_ros.ros.process.resources import use_fastdds_profile

FRAME = 'camera_optical_frame'


def image_message(pixels: np.ndarray, encoding: str) -> Image:
    """Return an image without stamp."""
    return Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                 step=pixels.strides[0], data=array('B', pixels.tobytes()))


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
    arguments = parser.parse_args()
    recording = np.load(arguments.frames)
    frames = [(image_message(colour, 'rgb8'), image_message(depth, '16UC1'))
              for colour, depth in zip(recording['colour'], recording['depth'])]
    with program('camera', use_fastdds_profile, interrupt=True):
        print(play(frames, recording['k'], arguments.rate, arguments.seconds, arguments.at_once))


def play(frames: list[tuple[Image, Image]], k: np.ndarray, rate: float, seconds: float,
         at_once: bool) -> int:
    """Publish frames, at once or when somebody listens to all topics; return how many."""
    node = rclpy.create_node('camera')
    reliable = QoSProfile(depth=10)
    colour, depth, info = (node.create_publisher(kind, topic, reliable) for kind, topic in (
        (Image, 'rgb/image'), (Image, 'depth/image'), (CameraInfo, 'rgb/camera_info')))
    camera_info = CameraInfo(
        width=frames[0][0].width, height=frames[0][0].height, k=k.ravel(),
        distortion_model='plumb_bob', d=[0.0] * 5)
    deadline = time.monotonic() + 20.0
    while not (at_once or all(
            publisher.get_subscription_count() for publisher in (colour, depth, info))):
        if time.monotonic() > deadline:
            sys.exit('camera: nobody listens')
        time.sleep(0.01)
    time.sleep(1.0)  # until the node's endpoints know ours too
    order = to_and_fro(len(frames))
    start, count = time.monotonic(), round(rate * seconds)
    for i in range(count):
        time.sleep(max(0.0, start + i / rate - time.monotonic()))
        stamped = header(time.time_ns(), FRAME)
        pair = frames[order[i % len(order)]]
        for message, publisher in zip((*pair, camera_info), (colour, depth, info)):
            message.header = stamped
            publisher.publish(message)
    time.sleep(1.0)
    return count


if __name__ == '__main__':
    main()
