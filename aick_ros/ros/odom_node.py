# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: colour and depth images in, odometry out; a drop-in for rtabmap's rgbd_odometry."""

from __future__ import annotations

import sys
import time
import traceback

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Empty

from aick_ros.errors import InputError
from aick_ros.odometry import Odometry
from aick_ros.ros.diagnostics import Diagnostics
from aick_ros.ros.inputs import Arrival, Inputs
from aick_ros.ros.parameters import declare_settings
from aick_ros.ros.publisher import OdometryPublisher
from aick_ros.ros.worker import Worker

_LONGEST_BACKLOG = 100  # pairs; at 640x480 one takes 1.5 to 2.1 MB
_THROTTLE = 5.0  # seconds between two log lines of the same kind


class OdomNode(Node):
    """
    Visual odometry of an RGB-D camera.

    Its inputs only pair images; a worker thread decodes them, registers and publishes.

    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self) -> None:
        super().__init__('odom_node')
        settings, core = declare_settings(self)
        self._odometry = Odometry(core)
        self._diagnostics = Diagnostics(self)
        self._publisher = OdometryPublisher(self, settings)
        self._worker = Worker(
            self._answer, capacity=_LONGEST_BACKLOG if settings.process_every_frame else 1,
            ready=lambda arrival: self._inputs.is_ready(arrival))
        self._inputs = Inputs(
            self, settings, self._diagnostics, self._worker.put, self._worker.nudge)
        self.create_service(Empty, '~/reset_odom', self._reset)
        # a steady timer: a /clock that stands still must not stop the report
        self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """End the worker; the frame at hand is finished."""
        self._worker.stop(timeout=1.0)

    def _answer(self, arrival: Arrival) -> None:
        """Register one pair and publish; whatever happens, the next one gets its turn."""
        stamp = arrival.pair.colour_stamp
        try:
            update = self._odometry.register_frame(self._inputs.frame(arrival))
            self._publisher.publish(update, self._inputs.camera_in_base(arrival))
        except InputError as error:
            self._diagnostics.damaged(str(error))
            self.get_logger().warning(f'frame {stamp} ns skipped: {error}',
                                      throttle_duration_sec=_THROTTLE)
        except Exception:  # a defect of ours in one frame must not end the odometry
            if not self.context.ok():
                return  # told to end while at work: nobody can be answered any more
            self._diagnostics.damaged('internal error, see the log')
            self.get_logger().error(f'frame {stamp} ns failed, please report this:\n'
                                    f'{traceback.format_exc()}')
        else:
            self._diagnostics.answered(update, 1e3 * (time.monotonic() - arrival.paired_at))
            if not update.status.ok:
                self.get_logger().warning(
                    f'frame {update.stamp} ns: {update.status.value}: {update.reason}',
                    throttle_duration_sec=_THROTTLE)

    def _report(self) -> None:
        complaint = self._inputs.complaint()
        if complaint:
            self.get_logger().warning(complaint, throttle_duration_sec=_THROTTLE)
        self._diagnostics.publish(
            self, complaint, backlog=self._worker.backlog,
            frames_dropped_under_load=self._worker.dropped, **self._inputs.counts)

    def _reset(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        def reset() -> None:
            self._odometry.reset()
            self._publisher.reset()
            self.get_logger().info('odometry reset')
        self._worker.run(reset)
        return response


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
