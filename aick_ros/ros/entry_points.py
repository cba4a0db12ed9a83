# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The executables: they prepare the process and say what is missing, then hand over."""

from __future__ import annotations

import os
import sys
from importlib import import_module


_PACKAGES = {'rosbags': 'pip install rosbags', 'cv2': 'apt install python3-opencv',
             'numpy': 'apt install python3-numpy'}


def odom_node() -> None:
    """Run the odometry node."""
    _run('odom_node')


def bag_player() -> None:
    """Play a bag."""
    _run('bag_player')


def _run(name: str) -> None:
    # Our matrices are small: more BLAS threads only take the processor from the executor, which
    # on two busy cores costs half the frame rate. NumPy reads this when it is first imported.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    try:
        program = import_module(f'aick_ros.ros.{name}')
    except ModuleNotFoundError as error:
        if (error.name or '').startswith('aick_ros'):
            raise
        module = (error.name or '').partition('.')[0]
        remedy = _PACKAGES.get(module, "source a ROS 2 Jazzy workspace, or pip install "
                               "'aick_ros[ros]'")
        print(f'{name}: {error.name} is not installed: {remedy}', file=sys.stderr)
        sys.exit(2)
    program.main()
