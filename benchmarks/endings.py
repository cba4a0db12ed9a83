# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Starts a program many times and ends it by signals, at any time of its start and of its work.

    python benchmarks/endings.py --starts 200 --program odom_node
    python benchmarks/endings.py --starts 200 --program bag_player BAG
    python benchmarks/endings.py --starts 200 --earliest 1

They are ended by two SIGINT 0 to 20 ms apart, as by a terminal and ros2 launch that both signal
the group, by SIGTERM, and by one of each, from the moment on that the process exists (or from
--earliest on); every fourth within the first twelfth of the time. Each must exit with 0 and print
no traceback.

The program is started as ros2 run does, by its launcher of scripts/, which holds the signals back
until the program handles them; with --directly by the entry point alone. Signals that come before
the launcher's first instruction, or with --directly before ours, find nothing that could handle
them: these are told apart, by the signals that the process blocks and catches.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from row import HEAD, Row

from aick_ros.evaluation.scores.machine import machine_facts

SCRIPTS = Path(__file__).parents[1] / 'scripts'
ENTRY_POINT = """#!{1}
from aick_ros.ros.process.entry_points import {0}
{0}()
"""
LONGEST_GAP = 0.02  # seconds
PATIENCE = 60.0  # seconds
WAYS = {'two SIGINT': (signal.SIGINT, signal.SIGINT), 'SIGTERM': (signal.SIGTERM,),
        'SIGINT and SIGTERM': (signal.SIGINT, signal.SIGTERM)}


@dataclass(frozen=True)
class Ending:
    """End of a program; ``fault`` is '' where it ended well."""

    fault: str
    is_early: bool  # the first signal came before anything of ours


def end(command: Sequence[str], delay: float, signals: Sequence[signal.Signals], gap: float
        ) -> Ending:
    """Start a program and signal it after some time [s]."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True)
    time.sleep(delay)
    is_early = not handles_signals(process.pid)
    for i, number in enumerate(signals):
        time.sleep(gap if i else 0.0)
        process.send_signal(number)
    try:
        errors = process.communicate(timeout=PATIENCE)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return Ending(f'does not end within {PATIENCE:g} s', False)
    if process.returncode or 'Traceback' in errors:
        return Ending(f'exit code {process.returncode}: {" ".join(errors.split())[-300:]}',
                      is_early)
    return Ending('', False)


def handles_signals(pid: int) -> bool:
    """Return whether a process blocks or catches SIGTERM, which Python by itself does not."""
    status = Path(f'/proc/{pid}/status').read_text(encoding='ascii')
    masks = (int(line.split()[1], 16) for line in status.splitlines()
             if line.startswith(('SigBlk:', 'SigCgt:', 'SigIgn:')))
    return any(mask >> signal.SIGTERM - 1 & 1 for mask in masks)


def command_of(program: str, directly: bool, folder: Path) -> str:
    """Install a program in a folder as pip does, and return the path to start it by."""
    entry_point, launcher = folder / 'bin' / program, folder / 'lib' / 'aick_ros' / program
    for path in (entry_point, launcher):
        path.parent.mkdir(parents=True)
    entry_point.write_text(ENTRY_POINT.format(program, sys.executable), encoding='utf-8')
    entry_point.chmod(0o755)
    shutil.copy(SCRIPTS / program, launcher)
    return str(entry_point if directly else launcher)


def main() -> None:
    """Print the table, and what was wrong."""
    given = parsed()
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    signal.signal(signal.SIGINT, signal.default_int_handler)  # nohup hands on an ignored one
    how = (f' --earliest {given.earliest:g}' if given.earliest else '') + (
        ' --directly' if given.directly else '')
    remake = f'python benchmarks/endings.py --starts {given.starts} --program {given.program}{how}'
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    chance = random.Random(0)
    with tempfile.TemporaryDirectory() as folder:
        command = [command_of(given.program, given.directly, Path(folder)), *given.arguments]
        for way, signals in WAYS.items():
            if given.way not in way:
                continue
            delays = [given.earliest + (given.longest - given.earliest) * chance.random() ** 2
                      for _ in range(given.starts)]
            faults = [ending for ending in (
                end(command, delay, signals, chance.uniform(0.0, LONGEST_GAP))
                for delay in delays) if ending.fault]
            early = sum(fault.is_early for fault in faults)
            print(Row(f'{given.program}, {given.starts} starts ended by {way}: not with 0', 0,
                      False, len(faults), '', remake, f'{early} of them before anything of ours'),
                  flush=True)
            for fault, count in Counter(faults).most_common():
                print(f'{count} x {fault.fault}', file=sys.stderr)


def parsed() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--starts', type=int, default=200, help='of each kind')
    parser.add_argument('--earliest', type=float, default=0.0, help='earliest signal [s]')
    parser.add_argument('--longest', type=float, default=3.0, help='latest signal [s]')
    parser.add_argument('--program', default='odom_node')
    parser.add_argument('--way', default='', help='only those whose name contains this')
    parser.add_argument('--directly', action='store_true', help='without the launcher')
    parser.add_argument('arguments', nargs='*')
    return parser.parse_args()


if __name__ == '__main__':
    main()
