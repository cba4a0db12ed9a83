# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: colour and depth images in, odometry out, by the topics of rgbd_odometry."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable
from functools import partial

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.messages.synchronizer import Pair
from aick_ros.odometry import Odometry
from aick_ros.odometry.base_odometry import BaseOdometry
from aick_ros.ros.control import Control
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.assembler import Arrival, FrameAssembler
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.guess import Guess, StartByGuess
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.rate_limit import RateLimit
from aick_ros.ros.input.rgbd_images import rgbd_subscription
from aick_ros.ros.input.subscriptions import AdaptiveSubscription, image_subscription
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.input.watchdog import Watchdog
from aick_ros.ros.output.publisher import OdometryPublisher
from aick_ros.ros.output.rtabmap import Registered, RtabmapTopics
from aick_ros.ros.output.views import Views
from aick_ros.ros.parameter_files import warnings_of_files
from aick_ros.ros.parameters import LiveSettings, declare_settings, initial_pose
from aick_ros.ros.process.arguments import Arguments, read_arguments
from aick_ros.ros.process.program import make_node, program
from aick_ros.ros.process.signals import held
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.ros.work_queue import WorkQueue
from aick_ros.ros.worker import Worker
from aick_ros.settings import NodeSettings, Settings

_LONGEST_BACKLOG = 100  # pairs; chosen: 3 s at 30 Hz
_LARGEST_BACKLOG = 256 * 2 ** 20  # bytes; chosen: a pair of 640x480 takes 1.5 to 2.1 MB
_SILENCE = 0.5  # seconds without an image after which no better partner is expected; chosen
_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen


class OdomNode(Node):
    """
    Visual odometry of an RGB-D camera.

    The executor's thread pairs images and queues the pairs; a worker thread decodes them,
    registers the frames and publishes. Services and changed parameters are tasks of the worker
    between two frames.

    :param arguments: of the command line, beside those of ROS.
    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self, arguments: Arguments = Arguments()) -> None:
        try:
            super().__init__('odom_node', automatically_declare_parameters_from_overrides=True)
        except ValueError as error:
            if 'PARAMETER_NOT_SET' not in str(error):
                raise
            raise InputError('a parameter is an empty list or has no value, and ROS '
                             'cannot infer its type: omit it') from None
        if arguments.level:
            self.get_logger().set_level(LoggingSeverity[arguments.level.upper()])
        settings, core = declare_settings(self, arguments.parameters)
        self._diagnostics = Diagnostics(self)
        self._queue = _queue(settings)
        # what frames are made of
        self._transforms = Transforms(
            self, (settings.odom_frame_id, settings.guess_frame_id or settings.frame_id),
            on_change=self._queue.wake)
        self._extrinsics = Extrinsics(self._transforms, settings)
        self._assembler = FrameAssembler(
            self, settings, self._extrinsics, on_change=self._queue.wake)
        # from frames to odometry
        self._guess = (Guess(self._transforms, self._extrinsics, settings)
                       if settings.guess_frame_id else None)
        self._start = StartByGuess(self._guess, settings)
        self._odometry = Odometry(core)
        self._base = BaseOdometry(initial_pose(settings))
        self._publisher = OdometryPublisher(self, settings, self._guess)
        self._views = Views(self, settings.odom_frame_id)
        self._rtabmap = RtabmapTopics(self, settings.odom_frame_id, self._odometry.local_map)
        self._live_settings = LiveSettings(core, self._change_settings)
        self._control = Control(self, settings.odom_frame_id, self._reset, self._set_pose)
        # from images to the queue
        self._rate_limit = RateLimit(settings.max_update_rate)
        self._pairing = Pairing(self, settings, self._diagnostics, self._enqueue)
        self._inputs = [*self._image_subscriptions(settings), *self._assembler.subscriptions]
        self._watchdog = Watchdog(self, settings, self._inputs, self._pairing)
        self._create_timers()
        self._worker = Worker(self._queue, self._answer, self._is_ready)
        self._between_frames(lambda: warm_up(core))

    def _image_subscriptions(self, settings: NodeSettings) -> list[AdaptiveSubscription]:
        if settings.subscribe_rgbd:
            return [rgbd_subscription(self, settings, self._assembler, self._pairing)]
        return [image_subscription(self, 'rgb/image', settings.image_transport,
                                   self._pairing.take_colour, settings),
                image_subscription(self, 'depth/image', settings.depth_transport,
                                   self._pairing.take_depth, settings)]

    def _create_timers(self) -> None:
        # steady timers: a /clock that stands still must not stop them
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_SILENCE / 2, self._tend_inputs, clock=steady)
        self.create_timer(1.0, self._report, clock=steady)

    def run(self) -> None:
        """Answer frames until the context is shut down."""
        self._worker.start()
        rclpy.spin(self)

    def close(self) -> None:
        """Finish the frame at hand and end."""
        self._worker.stop()
        self.destroy_node()

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters all or none; a rejection names range and unit."""
        return self._live_settings.set(parameter_list, super().set_parameters_atomically)

    # A frame, from the executor's thread ...

    def _enqueue(self, pair: Pair) -> None:
        """Queue a pair with the cameras as they are now."""
        if self._control.paused:
            self._diagnostics.count(Count.SKIPPED_WHILE_PAUSED)
        elif not self._rate_limit.admits(pair.colour_stamp):
            self._diagnostics.count(Count.SKIPPED_BY_RATE_LIMIT)
        else:
            self._queue.put(self._assembler.arrival(pair))

    # ... to the worker's

    def _is_ready(self, arrival: Arrival) -> bool:
        """Return whether a pair can be answered, or must not block the newest one, which can."""
        return any(not self._assembler.missing_for(pair)
                   for pair in (arrival.pair, self._pairing.newest) if pair)

    def _answer(self, arrival: Arrival) -> None:
        """Register a pair and publish; whatever happens, the next one is answered."""
        stamp = arrival.pair.colour_stamp
        try:
            self._register(arrival)
        except InputError as error:
            self._diagnostics.damaged(str(error))
            self.get_logger().warning(f'frame {stamp} ns skipped: {error}',
                                      throttle_duration_sec=_THROTTLE)
        except Exception:  # a defect of ours in one frame must not end the odometry
            if not self.context.ok():
                return  # a consequence of the shutdown
            self._diagnostics.damaged('internal error, see the log', Count.FAILED)
            self.get_logger().error(f'frame {stamp} ns failed, please report this:\n'
                                    f'{traceback.format_exc()}',
                                    throttle_duration_sec=_THROTTLE)

    def _register(self, arrival: Arrival) -> None:
        camera_frame = arrival.camera_frame
        frame = self._assembler.frame(arrival)
        T_base_camera = self._extrinsics.camera_in_base(camera_frame, frame.stamp)
        mount = self._extrinsics.camera_mount(camera_frame)
        start = self._start.pose(frame.stamp)
        if start is not None:
            self._base.reset(start)
        if self._guess is None:
            update = self._odometry.register_frame(frame)
        else:
            update = self._odometry.register_frame(
                frame, partial(self._guess.camera_motion, camera_frame))
        base = self._base.update(update, T_base_camera, mount)
        if base is not None:
            self._publisher.publish(base)
            self._rtabmap.show(Registered(update, base, T_base_camera, camera_frame))
        self._diagnostics.answered(
            update, 1e3 * (time.monotonic() - arrival.paired_at),
            1e-6 * (self.get_clock().now().nanoseconds - update.stamp))
        if not update.status.ok:
            self.get_logger().warning(
                f'frame {update.stamp} ns: {update.status.value}: {update.reason}',
                throttle_duration_sec=_THROTTLE)
        self._views.show(frame, update, self._base.pose.matrix, T_base_camera, camera_frame)

    # Requests, done by the worker between two frames.

    def _reset(self) -> None:
        def reset() -> None:
            self._odometry.reset()
            self._base.reset()
            self._start.reset()
            self._views.reset()
            self._rtabmap.reset()
            self.get_logger().info('odometry reset')
        self._between_frames(reset)

    def _set_pose(self, pose: PoseWithCovariance, paused: bool) -> None:
        def set_pose() -> None:
            self._base.set_pose(pose, paused)
            self._start.cancel()
            self.get_logger().info('pose set')
        self._between_frames(set_pose)

    def _change_settings(self, core: Settings) -> None:
        self._between_frames(lambda: self._odometry.change_settings(core))

    def _between_frames(self, task: Callable[[], None]) -> None:
        def run() -> None:
            try:
                task()
            except Exception:  # must not end the odometry, as little as a frame
                self.get_logger().error('failed between two frames, please report this:\n'
                                        f'{traceback.format_exc()}')
        self._queue.put_task(run)

    # Timers.

    def _tend_inputs(self) -> None:
        if self._watchdog.silent_for() > _SILENCE:
            self._pairing.flush()
        for subscription in self._inputs:
            subscription.adapt()
        self._transforms.tend()

    def _report(self) -> None:
        complaint = self._complaint()
        if complaint:
            self.get_logger().warning(complaint, throttle_duration_sec=_THROTTLE)
        for count, total in self._pairing.counts.items():
            self._diagnostics.count_up_to(count, total)
        self._diagnostics.count_up_to(Count.DROPPED_UNDER_LOAD, self._queue.dropped)
        self._diagnostics.publish(
            complaint, self._control.paused,
            {'backlog': str(self._queue.backlog),
             'backlog in MB': f'{self._queue.backlog_bytes / 1e6:.1f}'})

    def _complaint(self) -> str:
        """Return what is missing at the inputs, or for a subscriber, '' for nothing."""
        newest = self._pairing.newest
        return (self._watchdog.complaint_about_topics()
                or (self._assembler.missing_for(newest) if newest else '')
                or self._watchdog.complaint_about_clocks()
                or self._watchdog.complaint_about_losses()
                or self._rtabmap.complaint())


def _queue(settings: NodeSettings) -> WorkQueue[Arrival]:
    capacity = _LONGEST_BACKLOG if settings.process_every_frame else 1
    return WorkQueue(capacity, lambda arrival: arrival.size, _LARGEST_BACKLOG)


def main() -> None:
    """Run the node until SIGINT or SIGTERM."""
    with program('odom_node'):
        arguments = read_arguments(sys.argv)
        with held():  # rclpy complains where the context ends while it makes these
            node = make_node(lambda: OdomNode(arguments))
            rclpy.get_global_executor()  # of rclpy.spin
        for warning in warnings_of_files(sys.argv, node.get_fully_qualified_name()):
            node.get_logger().warning(warning)
        try:
            node.run()
        finally:
            node.close()


if __name__ == '__main__':
    main()
