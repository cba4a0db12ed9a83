# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Highest rate of a camera: at several sizes, and beside another process on one core."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from node_camera import Plan, shoot
from node_process import Listener, NodeProcess
from row import Row

from aick_ros.ros.playback.node_process import NODE_COMMAND

_EVERY_FRAME = {'process_every_frame': 'true', 'topic_queue_size': 100, 'sync_queue_size': 100}
_ON_ONE_CORE = 'taskset', '--cpu-list', '0'


def fast(plan: Plan) -> Iterator[Row]:
    """Frames lost at 60 Hz, and at 1280x720, where every frame counts."""
    command = f'python benchmarks/node.py --only fast --seconds {plan.seconds:g}'
    for size, rate in (('640x480', 60), ('1280x720', 30)):
        with Listener() as listener, NodeProcess(**_EVERY_FRAME) as node:
            sent, cpu = shoot(plan.recording(size), plan.seconds, node, '--rate', str(rate))
            _await_the_last(listener)
        yield Row(f'{size} at {rate} Hz, every frame, {plan.seconds:g} s: frames lost', 0, False,
                  sent - len(listener.received), f'of {sent}', command, f'{cpu:.2f} cores')
    with Listener() as listener, NodeProcess() as node:
        _, cpu = shoot(plan.recording('1920x1080'), plan.seconds, node, '--rate', '15')
    yield Row('1920x1080 at 15 Hz, newest frame: odometry', 15, True,
              len(listener.received) / plan.seconds, 'Hz', command, f'{cpu:.2f} cores')


def slow_core(plan: Plan) -> Iterator[Row]:
    """Frames lost at 30 Hz by a node that has half of a core."""
    command = f'python benchmarks/node.py --only slow_core --seconds {plan.seconds:g}'
    for name, parameters, must in (('default', {}, 0.05), ('embedded', {'preset': 'embedded'}, 0)):
        with (_busy_loop(), Listener() as listener,
              NodeProcess((*_ON_ONE_CORE, *NODE_COMMAND), **parameters) as node):
            sent, cpu = shoot(plan.recording('640x480'), plan.seconds, node)
            _await_the_last(listener)
        yield Row(f'640x480 at 30 Hz, half of a core, {name}: share of frames lost',
                  must, False, 1.0 - len(listener.received) / sent, '', command,
                  f'of {sent}, {cpu:.2f} cores')


@contextmanager
def _busy_loop() -> Iterator[None]:
    process = subprocess.Popen([*_ON_ONE_CORE, sys.executable, '-c', 'while True: pass'])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def _await_the_last(listener: Listener) -> None:
    """Wait until no answer has come for two seconds."""
    count = -1
    while count < len(listener.received):
        count = len(listener.received)
        time.sleep(2.0)
