# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Starts a program many times and ends it by signals, at any time of its start and of its work.

    python benchmarks/endings.py --starts 200 --program odom_node
    python benchmarks/endings.py --starts 200 --program bag_player BAG

They are ended by two SIGINT 0 to 20 ms apart, as by a terminal and ros2 launch that both signal
the group, by SIGTERM, and by one of each, from the moment on that the process exists; every
fourth within the first twelfth of the time. Each must exit with 0 and print no traceback.

While Python itself starts, nothing of the program can handle a signal: those that fail then are
told apart. With --prefix the program starts with the signals held back, as in

    python benchmarks/endings.py --prefix 'env --block-signal=INT,TERM'
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
from dataclasses import dataclass

from row import HEAD, Row

from aick_ros.evaluation.scores.machine import machine_facts

BEGIN = ('import os; os.write(1, b"code runs"); '
         'from aick_ros.ros.process.entry_points import {0}; {0}()')
LONGEST_GAP = 0.02  # seconds
PATIENCE = 60.0  # seconds
WAYS = {'two SIGINT': (signal.SIGINT, signal.SIGINT), 'SIGTERM': (signal.SIGTERM,),
        'SIGINT and SIGTERM': (signal.SIGINT, signal.SIGTERM)}


@dataclass(frozen=True)
class Ending:
    """How a program ended; ``fault`` is '' where it ended well."""

    fault: str
    in_interpreter: bool  # Python was still starting


def end(command: Sequence[str], delay: float, signals: Sequence[signal.Signals], gap: float
        ) -> Ending:
    """Start a program and signal it after some time [s]."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(delay)
    for i, number in enumerate(signals):
        time.sleep(gap if i else 0.0)
        process.send_signal(number)
    try:
        output, errors = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return Ending(f'does not end within {PATIENCE:g} s', False)
    if process.returncode or 'Traceback' in errors:
        return Ending(f'exit code {process.returncode}: {" ".join(errors.split())[-300:]}',
                      not output)
    return Ending('', False)


def main() -> None:
    """Print the table, and what was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--starts', type=int, default=200, help='of each kind')
    parser.add_argument('--longest', type=float, default=3.0, help='latest signal [s]')
    parser.add_argument('--program', default='odom_node')
    parser.add_argument('--way', default='', help='only those whose name contains this')
    parser.add_argument('--prefix', default='', help='put before the command')
    parser.add_argument('arguments', nargs='*')
    given = parser.parse_args()
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    signal.signal(signal.SIGINT, signal.default_int_handler)  # nohup hands on an ignored one
    command = [*given.prefix.split(), sys.executable, '-c', BEGIN.format(given.program),
               *given.arguments]
    prefix = f" --prefix '{given.prefix}'" if given.prefix else ''
    remake = (f'python benchmarks/endings.py --starts {given.starts} '
              f'--program {given.program}{prefix}')
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    chance = random.Random(0)
    for way, signals in WAYS.items():
        if given.way not in way:
            continue
        endings = [end(command, given.longest * chance.random() ** 2, signals,
                       chance.uniform(0.0, LONGEST_GAP)) for _ in range(given.starts)]
        faults = [ending for ending in endings if ending.fault]
        early = sum(fault.in_interpreter for fault in faults)
        print(Row(f'{given.program}, {given.starts} starts ended by {way}: not with 0', 0, False,
                  len(faults), '', remake, f'{early} of them while Python itself started'),
              flush=True)
        for fault, count in Counter(faults).most_common():
            print(f'{count} x {fault.fault}', file=sys.stderr)


if __name__ == '__main__':
    main()
