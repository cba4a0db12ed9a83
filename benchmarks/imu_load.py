# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Processor time of an IMU in the node.

    python benchmarks/imu_load.py RATE

Its input and its terms as the node uses them, thirty times a second, without images: the share of
a core for receiving samples of RATE Hz over DDS, and for computing with them.
"""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

from aick_ros.geometry.frame_tree import FrameTransform
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.ros.input.imu import ImuInput
from aick_ros.ros.input.transforms import Transforms
from aick_ros.settings import Settings

FRAMES, KEYFRAME = 30, 20  # Hz, frames
DELAY = 30_000_000  # ns, of an image
DURATION = 8.0  # s
SEEN = PoseWithCovariance(np.eye(4), 1e-6 * np.eye(6))


class Known(Transforms):
    """An IMU at the camera."""

    def __init__(self) -> None:
        pass

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0,
             largest_gap: int | None = None) -> FrameTransform:
        """Return no transform."""
        return FrameTransform(np.eye(4))


class Load:
    """Work of the node for an IMU at each frame, beside the images."""

    def __init__(self) -> None:
        self.node = rclpy.create_node('imu_load')
        self._input = ImuInput(self.node, Known(), lambda: None)
        self._input.activate()
        settings = Settings()
        self._gyroscope = Gyroscope(settings.imu, settings.odometry)
        self._gravity = Gravity(settings.imu)
        self._keyframe = self._count = self.samples = 0
        self.computing = 0.0  # s, of the processor
        self.node.create_timer(1 / FRAMES, self._frame)

    def _frame(self) -> None:
        stamp = self.node.get_clock().now().nanoseconds - DELAY
        self._input.reaches(stamp)
        samples = self._input.samples('camera', stamp)
        if samples is None:
            return
        start = time.thread_time()
        self.samples += len(samples)
        self._gyroscope.add(samples)
        self._gravity.add(samples, 0.0)
        if self._count % KEYFRAME == 0:
            self._keyframe = stamp
        if self._gravity.start is None:
            self._gravity.begin(stamp)
        self._count += 1
        if stamp > self._keyframe:
            for _ in range(3):  # before the images, with them, and for the increment
                self._gyroscope.term(self._keyframe, stamp)
            self._gyroscope.learn(self._keyframe, stamp, SEEN)
        self._gravity.update(stamp, SEEN, SEEN, np.eye(4), SEEN)
        self.computing += time.thread_time() - start


def publish(rate: float) -> None:
    """Publish samples at rest until killed."""
    node = rclpy.create_node('imu')
    publisher = node.create_publisher(Imu, 'imu', qos_profile_sensor_data)
    rng, start, count = np.random.default_rng(0), time.monotonic(), 0
    while True:
        sample = Imu()
        sample.header.stamp = node.get_clock().now().to_msg()
        sample.angular_velocity.x, sample.linear_acceleration.y = rng.normal((0, -9.8), 0.01)
        publisher.publish(sample)
        count += 1
        time.sleep(max(start + count / rate - time.monotonic(), 0.0))


def spin(executor: SingleThreadedExecutor, duration: float) -> float:
    """Return the share of a core that spinning for some time takes."""
    start, end = time.process_time(), time.monotonic() + duration
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.2)
    return (time.process_time() - start) / duration


def main() -> None:
    """Measure without and with the IMU."""
    rclpy.init()
    if sys.argv[2:] == ['publish']:
        publish(float(sys.argv[1]))
    load, executor = Load(), SingleThreadedExecutor()
    executor.add_node(load.node)
    spin(executor, 2.0)
    without = spin(executor, DURATION)
    imu = subprocess.Popen([sys.executable, __file__, sys.argv[1], 'publish'])
    try:
        while not load.samples:
            spin(executor, 1.0)
        load.samples, load.computing = 0, 0.0
        on_top = spin(executor, DURATION) - without
    finally:
        imu.kill()
    computing = load.computing / DURATION
    print(f'{load.samples / DURATION:.0f} samples per second: {on_top:.3f} of a core, of which '
          f'{on_top - computing:.3f} for receiving and {computing:.3f} for computing')


if __name__ == '__main__':
    main()
