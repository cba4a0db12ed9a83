# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Leads the node with a life cycle through many cycles while a camera runs, and watches its memory.

    python benchmarks/life_cycle.py --cycles 300

A cycle is configure, activate, the first odometry, deactivate, cleanup. The memory is that of the
unconfigured node, without the camera's segment of images, of which each process sees as much as
it has read. What a cycle frees is not always given back at once, so that the memory after single
cycles is some megabytes apart: its growth is the median slope over all pairs of cycles (Theil and
Sen), after those in which the libraries allocate.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from lifecycle_msgs.srv import ChangeState
from node_process import Listener, NodeProcess
from rclpy.client import Client
from row import HEAD, Row

from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.geometry.camera import Camera
from aick_ros.ros.process.resources import use_fastdds_profile
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COMMAND = (sys.executable, '-c', 'from aick_ros.ros.process.entry_points import '
           'odom_lifecycle_node; odom_lifecycle_node()')
CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
FRAMES = 10
WARM_UP = 10  # cycles
SPAN = 30  # cycles whose median is shown
PATIENCE = 60.0  # seconds


def recording(folder: Path) -> Path:
    """Return a file of rendered frames, as camera.py takes it."""
    source = SyntheticSource(SyntheticOptions(seed=1, frames=FRAMES, camera=CAMERA))
    frames = [source.frame(i) for i in range(FRAMES)]
    path = folder / 'frames.npz'
    np.savez(path, k=CAMERA.matrix, colour=np.array([frame.colour for frame in frames]),
             depth=np.array([np.rint(1000 * np.nan_to_num(frame.depth)).astype('<u2')
                             for frame in frames]))
    return path


def change(client: Client, transition: str) -> None:
    """Have a transition made; end the program where it fails."""
    request = ChangeState.Request()
    request.transition.label = transition
    if not client.call(request).success:
        sys.exit(f'{transition} failed')


def cycle(client: Client, listener: Listener) -> bool:
    """Return whether odometry came in one cycle, and none after it."""
    change(client, 'configure')
    listener.received.clear()
    change(client, 'activate')
    has_come = listener.wait_for_any(PATIENCE)
    change(client, 'deactivate')
    change(client, 'cleanup')
    return has_come


def median_slope(values: list[float]) -> float:
    """Return the median growth from one value to the next, over all pairs of values."""
    earlier, later = np.triu_indices(len(values), 1)
    known = np.asarray(values)
    return float(np.median((known[later] - known[earlier]) / (later - earlier)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--cycles', type=int, default=300)
    cycles = parser.parse_args().cycles
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    use_fastdds_profile()
    command = f'python benchmarks/life_cycle.py --cycles {cycles}'
    memory, answered = [], 0
    with (tempfile.TemporaryDirectory() as folder, Listener() as listener,
          NodeProcess(COMMAND) as node):
        client = listener.node.create_client(ChangeState, '/odom_node/change_state')
        client.wait_for_service(PATIENCE)
        camera = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name('camera.py')),
             str(recording(Path(folder))), '--seconds', '3600', '--at-once'])
        for _ in range(WARM_UP + cycles):
            answered += cycle(client, listener)
            memory.append(node.own_megabytes)
        camera.terminate()
        camera.wait()
    memory = memory[WARM_UP:]
    medians = [np.median(memory[i:i + SPAN]) for i in range(0, cycles, SPAN)]
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    print(Row(f'{WARM_UP + cycles} cycles: without odometry', 0, False,
              WARM_UP + cycles - answered, '', command))
    print(Row('memory of the unconfigured node: growth in 100 cycles', 1, False,
              100 * median_slope(memory), 'MB', command,
              ' '.join(f'{value:.1f}' for value in medians)))


if __name__ == '__main__':
    main()
