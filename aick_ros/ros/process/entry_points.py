# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The executables: they prepare the process and say what is missing, then hand over."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

_ENDINGS = (signal.SIGINT, signal.SIGTERM)

_PACKAGES = {'rosbags': 'pip install rosbags', 'cv2': 'apt install python3-opencv',
             'numpy': 'apt install python3-numpy'}


def odom_node() -> None:
    """Run the odometry node."""
    _run('odom_node', 'aick_ros.ros.odom_node')


def bag_player() -> None:
    """Play a bag."""
    _run('bag_player', 'aick_ros.ros.playback.bag_player')


def _run(name: str, module_name: str) -> None:
    try:
        with _ending_waits():
            program = import_module(module_name)
    except KeyboardInterrupt:
        return  # told to end before it began
    except ModuleNotFoundError as error:
        if (error.name or '').startswith('aick_ros'):
            raise
        module = (error.name or '').partition('.')[0]
        remedy = _PACKAGES.get(module, "source a ROS 2 Jazzy workspace, or pip install "
                               "'aick_ros[ros]'")
        print(f'{name}: {error.name} is not installed: {remedy}', file=sys.stderr)
        sys.exit(2)
    program.main()


@contextmanager
def _ending_waits() -> Iterator[None]:
    """Hold back Ctrl-C and SIGTERM: an import that is interrupted fails in odd ways."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # until rclpy has its own
    signal.pthread_sigmask(signal.SIG_BLOCK, _ENDINGS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDINGS)
