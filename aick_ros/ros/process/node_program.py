# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The program of an odometry node."""

from __future__ import annotations

import sys
from collections.abc import Callable

import rclpy

from aick_ros.ros.arguments import Arguments, read_arguments
from aick_ros.ros.parameter_files import warnings_of_files
from aick_ros.ros.parameter_node import ParameterNode
from aick_ros.ros.process.program import make_node, program
from aick_ros.ros.process.signals import held


def run_node(name: str, make: Callable[[Arguments], ParameterNode]) -> None:
    """
    Run a node until SIGINT or SIGTERM.

    :param name: of the program.
    :param make: makes the node from the arguments beside those of ROS.
    """
    # read before ROS begins, which warns of some that are not its own
    with program(name, prepare=lambda: read_arguments(sys.argv)) as arguments:
        with held():  # rclpy complains where the context ends while it makes these
            node = make_node(lambda: make(arguments))
            rclpy.get_global_executor()  # of rclpy.spin
        for warning in warnings_of_files(sys.argv, node.get_fully_qualified_name()):
            node.get_logger().warning(warning)
        try:
            node.run()
        finally:
            node.close()
