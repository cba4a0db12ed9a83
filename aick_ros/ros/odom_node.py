# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: colour and depth images in, odometry out; a drop-in for rtabmap's rgbd_odometry."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Empty

from aick_ros import image_codec, rigid
from aick_ros.camera import Camera
from aick_ros.errors import InputError
from aick_ros.frame import RgbdFrame
from aick_ros.odometry import Odometry
from aick_ros.ros.diagnostics import Diagnostics
from aick_ros.ros.messages import to_stamp
from aick_ros.ros.parameters import declare_settings
from aick_ros.ros.publisher import OdometryPublisher
from aick_ros.ros.transforms import StaticTransforms
from aick_ros.ros.watchdog import Watchdog
from aick_ros.ros.worker import Worker
from aick_ros.settings import NodeSettings
from aick_ros.synchronizer import Pair, Synchronizer

_LONGEST_BACKLOG = 100  # pairs; at 640x480 one takes 1.5 to 2.1 MB
_SILENCE = 0.5  # seconds after which no better partner is expected
_THROTTLE = 5.0  # seconds between two log lines of the same kind


class _Job(NamedTuple):
    """A pair, the camera as it was then (None: not known yet), and the steady time [s]."""

    pair: Pair
    camera: Camera | None
    paired_at: float


class OdomNode(Node):
    """
    Visual odometry of an RGB-D camera.

    Callbacks only pair images; a worker thread decodes them, registers and publishes.

    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self) -> None:
        super().__init__('odom_node')
        settings, core = declare_settings(self)
        self._camera: Camera | None = None
        self._newest: Pair | None = None
        self._odometry = Odometry(core)
        self._diagnostics = Diagnostics(self)
        self._publisher = OdometryPublisher(self, settings)
        self._synchronizer = Synchronizer(
            settings.approx_sync_max_interval if settings.approx_sync else 0.0,
            settings.sync_queue_size)
        self._worker = Worker(
            self._answer, capacity=_LONGEST_BACKLOG if settings.process_every_frame else 1,
            # where the newest pair can be answered, one that cannot must not block the others
            ready=lambda job: '' in (self._missing_for(job.pair),
                                     self._missing_for(self._newest)))
        self._extrinsics = StaticTransforms(
            self, settings.frame_id, _given_extrinsic(settings), self._worker.nudge)
        self._watchdog = Watchdog(self, self._subscribe(settings), settings)
        self.create_service(Empty, '~/reset_odom', self._reset)
        # steady timers: a /clock that stands still must not stop the watch
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_SILENCE / 2, self._flush, clock=steady)
        self.create_timer(1.0, self._report, clock=steady)

    def close(self) -> None:
        """End the worker; the frame at hand is finished."""
        self._worker.stop(timeout=1.0)

    def _subscribe(self, settings: NodeSettings) -> dict[str, Any]:
        qos = QoSProfile(depth=settings.topic_queue_size,
                         reliability=ReliabilityPolicy[settings.qos_reliability.upper()])
        return {name: self.create_subscription(kind, name, callback, qos)
                for name, kind, callback in (
                    ('rgb/image', Image, self._take_colour),
                    ('depth/image', Image, self._take_depth),
                    ('rgb/camera_info', CameraInfo, self._take_camera_info))}

    def _take_colour(self, message: Image) -> None:
        self._watchdog.saw('rgb/image')
        self._take(self._synchronizer.add_colour, message)

    def _take_depth(self, message: Image) -> None:
        self._watchdog.saw('depth/image')
        self._take(self._synchronizer.add_depth, message)

    def _take_camera_info(self, message: CameraInfo) -> None:
        try:
            camera = Camera.from_camera_info(
                message.width, message.height, message.k, message.d, message.distortion_model)
        except InputError as error:
            self.get_logger().warning(
                f'camera_info refused: {error}', throttle_duration_sec=_THROTTLE)
            return
        self._watchdog.wants_no_more('rgb/camera_info')  # some drivers send it once
        if camera != self._camera:
            self._camera = camera
            self.get_logger().info(f'camera: {camera}')
            self._worker.nudge()

    def _take(self, add: Callable[[int, Image], list[Pair]], image: Image) -> None:
        stamp, late = to_stamp(image.header.stamp), self._synchronizer.late
        if stamp <= 0:
            self._refuse(f'image left out: its stamp is {stamp} ns; the driver must stamp its '
                         'images')
            return
        self._queue(add(stamp, image))
        if self._synchronizer.late > late:
            self._refuse(f'image of {stamp} ns left out: its stamp repeats or goes back; is the '
                         'driver publishing twice?')

    def _refuse(self, sentence: str) -> None:
        self._diagnostics.count('images refused')
        self._watchdog.refused(sentence)
        self.get_logger().warning(sentence, throttle_duration_sec=_THROTTLE)

    def _queue(self, pairs: list[Pair]) -> None:
        for pair in pairs:
            self._diagnostics.count('frames received')
            self._newest = pair
            self._watchdog.saw_pair()
            self._worker.put(_Job(pair, self._camera, time.monotonic()))

    def _flush(self) -> None:
        if self._watchdog.quiet_for() > _SILENCE:
            self._queue(self._synchronizer.flush())

    def _missing_for(self, pair: Pair) -> str:
        """Return what a pair still needs before it can be registered, '' for nothing."""
        if self._camera is None:
            return 'images come but no usable camera_info on rgb/camera_info'
        try:
            self._extrinsics.camera_in_base(pair.colour.header.frame_id)
        except InputError as error:
            return str(error)
        return ''

    def _answer(self, job: _Job) -> None:
        """Register one pair and publish; whatever happens, the next one gets its turn."""
        pair, camera = job.pair, job.camera or self._camera
        try:
            update = self._odometry.register_frame(RgbdFrame(
                pair.colour_stamp, image_codec.colour_image(pair.colour),
                image_codec.depth_image(pair.depth), camera, pair.depth_stamp))
            self._publisher.publish(
                update, self._extrinsics.camera_in_base(pair.colour.header.frame_id))
        except InputError as error:
            self._diagnostics.damaged(str(error))
            self.get_logger().warning(
                f'frame {pair.colour_stamp} ns skipped: {error}', throttle_duration_sec=_THROTTLE)
        except Exception:  # a defect of ours in one frame must not end the odometry
            if not self.context.ok():
                return  # told to end while at work: nobody can be answered any more
            self._diagnostics.damaged('internal error, see the log')
            self.get_logger().error(f'frame {pair.colour_stamp} ns failed, please report this:\n'
                                    f'{traceback.format_exc()}')
        else:
            self._diagnostics.answered(update, 1e3 * (time.monotonic() - job.paired_at))
            if not update.status.ok:
                self.get_logger().warning(
                    f'frame {update.stamp} ns: {update.status.value}: {update.reason}',
                    throttle_duration_sec=_THROTTLE)

    def _report(self) -> None:
        complaint = self._watchdog.complaint()
        if not complaint and self._newest is not None:
            complaint = self._missing_for(self._newest)
        if complaint:
            self.get_logger().warning(complaint, throttle_duration_sec=_THROTTLE)
        unpaired = self._synchronizer.unpaired
        self._diagnostics.publish(
            self, complaint, backlog=self._worker.backlog,
            frames_dropped_under_load=self._worker.dropped,
            colour_images_without_depth=unpaired['colour'],
            depth_images_without_colour=unpaired['depth'])

    def _reset(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        def reset() -> None:
            self._odometry.reset()
            self._publisher.reset()
            self.get_logger().info('odometry reset')
        self._worker.run(reset)
        return response


def _given_extrinsic(settings: NodeSettings) -> np.ndarray | None:
    numbers = settings.camera_in_base
    if not numbers:
        return None
    try:
        x, y, z, *quaternion = numbers
        return rigid.from_quaternion(quaternion, (x, y, z))
    except ValueError:
        raise InputError(f'camera_in_base = {list(numbers)} is no pose: it takes x y z qx qy qz '
                         'qw') from None


def _initialise() -> None:
    try:
        rclpy.init()
    except Exception as error:  # rclpy has its own types for what rcl refuses
        raise InputError(f'ROS does not take these arguments: {error}') from None


def main() -> None:
    """Run the node until it is told to end."""
    try:
        _initialise()
        node = OdomNode()
    except InputError as error:
        rclpy.try_shutdown()
        print(f'odom_node: {error}', file=sys.stderr)
        sys.exit(2)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.close()
        node.destroy_node()
        rclpy.try_shutdown()
