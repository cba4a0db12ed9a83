# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: colour and depth images in, odometry out; a drop-in for rtabmap's rgbd_odometry."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Sequence

import numpy as np
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.ros.control import Control
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.guess import Guess
from aick_ros.ros.input.inputs import Arrival, Inputs
from aick_ros.ros.input.rate_limit import RateLimit
from aick_ros.ros.output.publisher import OdometryPublisher
from aick_ros.ros.output.views import Views
from aick_ros.ros.parameters import LiveSettings, declare_settings
from aick_ros.ros.process.program import program
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.ros.worker import Worker
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings

_LONGEST_BACKLOG = 100  # pairs; at 640x480 one takes 1.5 to 2.1 MB
_LARGEST_BACKLOG = 256 * 2 ** 20  # bytes
_THROTTLE = 5.0  # seconds between two log lines of the same kind


class OdomNode(Node):
    """
    Visual odometry of an RGB-D camera.

    Its inputs only pair images; a worker thread decodes them, registers and publishes. What is
    asked of the node from outside is done on that thread too, between two frames.

    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self) -> None:
        super().__init__('odom_node', automatically_declare_parameters_from_overrides=True)
        settings, core = declare_settings(self)
        self._live_settings = LiveSettings(core, self._change)
        self._odometry = Odometry(core, predict=self._predict)
        self._diagnostics = Diagnostics(self)
        self._views = Views(self, settings.odom_frame_id)
        self._worker = self._make_worker(settings)
        self._rate_limit = RateLimit(settings.max_update_rate)
        self._inputs = Inputs(
            self, settings, self._diagnostics, self._take, self._worker.nudge)
        self._guess = Guess(self._inputs, settings) if settings.guess_frame_id else None
        self._publisher = OdometryPublisher(self, settings, self._guess)
        self._control = Control(self, settings.odom_frame_id, self._reset, self._set_pose)
        self._between_frames(lambda: warm_up(core))
        # a steady timer: a /clock that stands still must not stop the report
        self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """End the worker; the frame at hand is finished."""
        self._worker.stop(timeout=0.5)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]
                                  ) -> SetParametersResult:
        """Set parameters all or none; a refusal names range and unit."""
        return self._live_settings.set(parameter_list, super().set_parameters_atomically)

    def _make_worker(self, settings: NodeSettings) -> Worker:
        return Worker(
            self._answer, capacity=_LONGEST_BACKLOG if settings.process_every_frame else 1,
            ready=lambda arrival: self._inputs.is_ready(arrival),
            size=_size, max_bytes=_LARGEST_BACKLOG)

    def _take(self, arrival: Arrival) -> None:
        if self._control.paused:
            self._diagnostics.count(Count.SKIPPED_WHILE_PAUSED)
        elif not self._rate_limit.admits(arrival.pair.colour_stamp):
            self._diagnostics.count(Count.SKIPPED_BY_RATE_LIMIT)
        else:
            self._worker.put(arrival)

    def _answer(self, arrival: Arrival) -> None:
        """Register one pair and publish; whatever happens, the next one gets its turn."""
        stamp = arrival.pair.colour_stamp
        try:
            self._register(arrival)
        except InputError as error:
            self._diagnostics.damaged(str(error))
            self.get_logger().warning(f'frame {stamp} ns skipped: {error}',
                                      throttle_duration_sec=_THROTTLE)
        except Exception:  # a defect of ours in one frame must not end the odometry
            if not self.context.ok():
                return  # told to end while at work: nobody can be answered any more
            self._diagnostics.damaged('internal error, see the log', Count.FAILED)
            self.get_logger().error(f'frame {stamp} ns failed, please report this:\n'
                                    f'{traceback.format_exc()}',
                                    throttle_duration_sec=_THROTTLE)

    def _register(self, arrival: Arrival) -> None:
        frame = self._inputs.frame(arrival)
        T_base_camera = self._T_base_camera = self._inputs.camera_in_base(arrival)
        update = self._odometry.register_frame(frame)
        self._publisher.publish(update, T_base_camera, self._inputs.camera_mount(arrival))
        self._diagnostics.answered(
            update, 1e3 * (time.monotonic() - arrival.paired_at),
            1e-6 * (self.get_clock().now().nanoseconds - update.stamp))
        if not update.status.ok:
            self.get_logger().warning(
                f'frame {update.stamp} ns: {update.status.value}: {update.reason}',
                throttle_duration_sec=_THROTTLE)
        self._views.show(frame, update, self._publisher.T_odom_base, T_base_camera,
                         arrival.pair.colour.header.frame_id)

    def _predict(self, before: int, now: int) -> np.ndarray | None:
        """Return ``T_camera0_camera1`` between two stamps [ns] by the guess, None without."""
        moved = self._guess.motion(before, now) if self._guess else None
        if moved is None:
            return None
        return se3.inverse(self._T_base_camera) @ moved @ self._T_base_camera

    def _report(self) -> None:
        complaint = self._inputs.complaint()
        if complaint:
            self.get_logger().warning(complaint, throttle_duration_sec=_THROTTLE)
        for count, total in self._inputs.counts.items():
            self._diagnostics.count_up_to(count, total)
        self._diagnostics.count_up_to(Count.DROPPED_UNDER_LOAD, self._worker.dropped)
        self._diagnostics.publish(
            complaint, self._control.paused,
            {'backlog': str(self._worker.backlog),
             'backlog in MB': f'{self._worker.backlog_bytes / 1e6:.1f}'})

    def _reset(self) -> None:
        def reset() -> None:
            self._odometry.reset()
            self._publisher.reset()
            self._views.reset()
            self.get_logger().info('odometry reset')
        self._between_frames(reset)

    def _set_pose(self, T_odom_base: np.ndarray, covariance: np.ndarray) -> None:
        def set_pose() -> None:
            self._publisher.set_pose(T_odom_base, covariance, self._control.paused)
            self.get_logger().info('pose set')
        self._between_frames(set_pose)

    def _change(self, core: Settings) -> None:
        self._between_frames(lambda: self._odometry.change_settings(core))

    def _between_frames(self, errand: Callable[[], None]) -> None:
        def run() -> None:
            try:
                errand()
            except Exception:  # as little as a frame must it end the odometry
                self.get_logger().error('failed between two frames, please report this:\n'
                                        f'{traceback.format_exc()}')
        self._worker.run(run)


def _size(arrival: Arrival) -> int:
    return len(arrival.pair.colour.data) + len(arrival.pair.depth.data)


def main() -> None:
    """Run the node until it is told to end."""
    with program('odom_node'):
        node = OdomNode()
        try:
            rclpy.spin(node)
        finally:
            node.close()
            node.destroy_node()


if __name__ == '__main__':
    main()
