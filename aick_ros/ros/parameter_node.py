# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node whose parameters are the settings."""

from __future__ import annotations

import time
import traceback

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.ros.arguments import Arguments
from aick_ros.ros.parameters import LiveSettings, declare_settings
from aick_ros.ros.robust_node import RobustNode
from aick_ros.ros.typed_topics import TypedTopics

_THROTTLE = 5.0  # seconds between two log lines; chosen
_PAUSE = 0.1  # s; chosen: a failure that repeats must not take the processor


class ParameterNode(RobustNode, TypedTopics):
    """
    A node that declares the settings as its parameters.

    :param arguments: of the command line, beside those of ROS.
    :raises InputError: where ROS cannot infer the type of a parameter.
    """

    def __init__(self, arguments: Arguments) -> None:
        self._live_settings: LiveSettings | None = None
        self._rejected_as_read_only: bool | None = None  # how they are to be declared again
        try:
            super().__init__('odom_node', automatically_declare_parameters_from_overrides=True)
        except ValueError as error:
            if 'PARAMETER_NOT_SET' not in str(error):
                raise
            raise InputError('a parameter is an empty list or has no value, and ROS '
                             'cannot infer its type: omit it') from None
        self._theirs = arguments.parameters
        if arguments.level:
            self.get_logger().set_level(LoggingSeverity[arguments.level.upper()])
        for word in arguments.of_slam:
            self.get_logger().info(
                f'argument {word} is one of the SLAM node of RTAB-Map and changes nothing here')

    def run(self) -> None:
        """Do what is requested until the context is shut down."""
        # a signal wakes rclpy's executor just before it shuts the context down; one that waits
        # again in between would wait for ever without a timer
        self.create_timer(1.0, lambda: None, clock=Clock(clock_type=ClockType.STEADY_TIME))
        while self.context.ok():
            try:
                rclpy.spin(self)
                return
            except InputError as error:
                self.get_logger().error(f'{error}', throttle_duration_sec=_THROTTLE)
                time.sleep(_PAUSE)
            except Exception:  # of one callback, which must not end the odometry
                if not self.context.ok():
                    raise  # a consequence of the shutdown
                self.get_logger().error('a request failed, please report this:\n'
                                        f'{traceback.format_exc()}',
                                        throttle_duration_sec=_THROTTLE)
                time.sleep(_PAUSE)

    def close(self) -> None:
        """End."""
        self.destroy_node()

    def declare(self, read_only: bool = True) -> LiveSettings:
        """
        Declare every parameter, once, and return the settings.

        :param read_only: whether those that are read once can never be set.
        :raises InputError: where one cannot be used; none is declared then.
        """
        if self._live_settings is None:
            try:
                self._live_settings = LiveSettings(
                    *declare_settings(self, self._theirs, read_only))
            except InputError:
                self._rejected_as_read_only = read_only
                raise
        return self._live_settings

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        Set parameters all or none; a rejection names range and unit.

        Where one could not be used when they were declared, it is to be corrected before others.
        """
        store = super().set_parameters_atomically
        are_known = all(self.has_parameter(parameter.name) for parameter in parameter_list)
        if not are_known and self._rejected_as_read_only is not None:
            try:
                self.declare(self._rejected_as_read_only)
            except InputError as error:
                return SetParametersResult(successful=False,
                                           reason=f'this is to be corrected first: {error}')
        if self._live_settings is None:  # each is checked when they are declared
            return store(parameter_list)
        return self._live_settings.set(parameter_list, store)
