# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Starts a program many times and ends it by signals, at any time of its start and of its work.

    python benchmarks/endings.py --starts 200 --program odom_node
    python benchmarks/endings.py --starts 200 --program bag_player BAG

They are ended by two SIGINT 0 to 20 ms apart, as by a terminal and ros2 launch that both signal
the group, by SIGTERM, and by one of each. Each must exit with 0 and print no traceback.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence

from row import HEAD, Row

from aick_ros.evaluation.scores.machine import machine_facts

BEGIN = ('from aick_ros.ros.process.entry_points import {0}; print(flush=True); {0}()')
LONGEST_GAP = 0.02  # seconds
EARLIEST = 0.05  # seconds; before its own code runs, nothing of it can handle a signal
PATIENCE = 60.0  # seconds
WAYS = {'two SIGINT': (signal.SIGINT, signal.SIGINT), 'SIGTERM': (signal.SIGTERM,),
        'SIGINT and SIGTERM': (signal.SIGINT, signal.SIGTERM)}


def end(command: Sequence[str], delay: float, signals: Sequence[signal.Signals], gap: float
        ) -> str:
    """Start a program, signal it after some time [s]; return what was wrong, '' for nothing."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()  # its own code runs
    time.sleep(delay)
    for i, number in enumerate(signals):
        time.sleep(gap if i else 0.0)
        process.send_signal(number)
    try:
        _, errors = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return f'does not end within {PATIENCE:g} s'
    if process.returncode or 'Traceback' in errors:
        return f'exit code {process.returncode}: {" ".join(errors.split())[-300:]}'
    return ''


def main() -> None:
    """Print the table, and what was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--starts', type=int, default=200, help='of each kind')
    parser.add_argument('--longest', type=float, default=3.0, help='latest signal [s]')
    parser.add_argument('--program', default='odom_node')
    parser.add_argument('arguments', nargs='*')
    given = parser.parse_args()
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    signal.signal(signal.SIGINT, signal.default_int_handler)  # nohup hands on an ignored one
    command = [sys.executable, '-c', BEGIN.format(given.program), *given.arguments]
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    chance = random.Random(0)
    for way, signals in WAYS.items():
        faults: Counter[str] = Counter()
        for _ in range(given.starts):
            fault = end(command, chance.uniform(EARLIEST, given.longest), signals,
                        chance.uniform(0.0, LONGEST_GAP))
            if fault:
                faults[fault] += 1
        print(Row(f'{given.program}, {given.starts} starts ended by {way}: not with 0', 0, False,
                  sum(faults.values()), '', 'python benchmarks/endings.py '
                  f'--starts {given.starts} --program {given.program}'), flush=True)
        for fault, count in faults.most_common():
            print(f'{count} x {fault}', file=sys.stderr)


if __name__ == '__main__':
    main()
