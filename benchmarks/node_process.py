# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node in a process of its own, watched from outside, and who listens to it."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.playback.node_process import NODE_COMMAND

_TICKS = os.sysconf('SC_CLK_TCK')
_PAGE = os.sysconf('SC_PAGE_SIZE')


class NodeProcess:
    """A node with parameters; leave the ``with`` block to end it."""

    def __init__(self, command: Sequence[str] = NODE_COMMAND, **parameters: Any) -> None:
        self._arguments = [*command, '--ros-args', '--log-level', 'error']
        for name, value in {'frame_id': 'camera_optical_frame', **parameters}.items():
            self._arguments += ['-p', f'{name}:={value}']

    def __enter__(self) -> NodeProcess:
        """Start the node."""
        self._process = subprocess.Popen(self._arguments)
        return self

    def __exit__(self, *error: object) -> None:
        """End the node."""
        self._process.send_signal(signal.SIGINT)
        self._process.wait(timeout=10.0)

    @property
    def alive(self) -> bool:
        """Return whether the process runs."""
        return self._process.poll() is None

    @property
    def cpu_seconds(self) -> float:
        """CPU time used so far [s]."""
        fields = Path(f'/proc/{self._process.pid}/stat').read_text().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS

    @property
    def resident_megabytes(self) -> float:
        """Its resident memory [MB]."""
        pages = int(Path(f'/proc/{self._process.pid}/statm').read_text().split()[1])
        return pages * _PAGE / 1e6

    @property
    def own_megabytes(self) -> float:
        """Its resident memory [MB] without segments it shares, such as the camera's images."""
        status = Path(f'/proc/{self._process.pid}/status').read_text()
        kilobytes = {line.split()[0]: int(line.split()[1]) for line in status.splitlines()
                     if line.startswith(('VmRSS:', 'RssShmem:'))}
        return 1.024e-3 * (kilobytes['VmRSS:'] - kilobytes['RssShmem:'])


class Listener:
    """Records the odometry; leave the ``with`` block to end it."""

    def __enter__(self) -> Listener:
        """Begin to listen on a thread of its own."""
        rclpy.init(args=[])
        self.node = rclpy.create_node('listener')
        self.received: dict[int, tuple[float, Odometry]] = {}
        self.node.create_subscription(Odometry, 'odom', self._take, 1000)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """End the thread."""
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def wait_for(self, stamp: int, seconds: float) -> bool:
        """Return whether the odometry of a stamp [ns] comes in time."""
        deadline = time.monotonic() + seconds
        while stamp not in self.received:
            if time.monotonic() > deadline:
                return False
            time.sleep(0.0005)
        return True

    def wait_for_any(self, seconds: float) -> bool:
        """Return whether any odometry comes in time."""
        deadline = time.monotonic() + seconds
        while not self.received and time.monotonic() < deadline:
            time.sleep(0.005)
        return bool(self.received)

    def _take(self, message: Odometry) -> None:
        self.received[to_stamp(message.header.stamp)] = time.time(), message

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass
