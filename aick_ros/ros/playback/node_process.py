# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry node in a process of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from aick_ros.borders.parent import supervised
from aick_ros.ros.process.signals import held
from aick_ros.settings.parameter import Value

NODE_COMMAND = (sys.executable, '-c',
                'from aick_ros.ros.process.entry_points import odom_node; odom_node()')

_END_TIMEOUT = 5.0  # seconds; chosen: as long as ros2 launch waits after SIGINT


@contextmanager
def node_process(command: Sequence[str], remappings: Mapping[str, str],
                 parameters: Mapping[str, Value]) -> Iterator[subprocess.Popen[bytes]]:
    """
    Start the node for the length of a block; it ends with this process, however that ends.

    :param command: the command that starts it.
    :param remappings: unresolved name -> topic.
    :param parameters: name -> value.
    """
    arguments = ['--ros-args']
    for name, topic in remappings.items():
        arguments += ['-r', f'{name}:={topic}']
    for name, value in parameters.items():
        arguments += ['-p', f'{name}:={_yaml(value)}']
    with held():  # inherited: until its program handles them, Python itself would end by them
        process = subprocess.Popen([*command, *arguments], env=supervised())
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_END_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _yaml(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else str(value)
