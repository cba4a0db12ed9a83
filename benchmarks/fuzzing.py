# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Ten minutes of damaged inputs to all that reads input: exceptions, hangs, memory.

    python benchmarks/fuzzing.py --seconds 600

It runs tools/fuzz, and watches the memory of its processes: the growth is that of the largest sum
in a second, from the first third of the time to the last one.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from row import HEAD, Row

from aick_ros.evaluation.scores.machine import machine_facts

FUZZ = Path(__file__).parents[1] / 'tools' / 'fuzz'
LARGEST_GROWTH = 50.0  # MB; chosen: allocators keep some, what leaks in each input is more


def resident_megabytes(pid: int) -> float:
    """Return the memory of a process and its children that is resident and not shared [MB]."""
    try:
        status = Path(f'/proc/{pid}/status').read_text(encoding='ascii')
        children = Path(f'/proc/{pid}/task/{pid}/children').read_text(encoding='ascii').split()
    except OSError:  # it has ended
        return 0.0
    anonymous = re.search(r'RssAnon:\s+(\d+) kB', status)
    own = 1.024e-3 * int(anonymous[1]) if anonymous else 0.0
    return own + sum(resident_megabytes(int(child)) for child in children)


def main() -> None:
    """Print the table, and the lines of the fuzzer."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=600.0)
    seconds = parser.parse_args().seconds
    memory = []
    with tempfile.TemporaryDirectory() as folder:
        fuzz = subprocess.Popen(
            [sys.executable, FUZZ, '--seconds', str(seconds), '--keep', f'{folder}/findings'],
            stdout=subprocess.PIPE, text=True)
        while fuzz.poll() is None:
            memory.append(resident_megabytes(fuzz.pid))
            time.sleep(1.0)
        lines = fuzz.communicate()[0]
    counts = re.findall(r'(\d+) inputs, (\d+) findings', lines)
    third = max(len(memory) // 3, 1)
    command = f'python benchmarks/fuzzing.py --seconds {seconds:g}'
    print(json.dumps(machine_facts()))
    print(lines)
    print(HEAD)
    print(Row('exceptions other than InputError, and hangs', 0, False,
              sum(int(found) for _, found in counts), '', command,
              f'{sum(int(count) for count, _ in counts)} inputs to {len(counts)} targets'))
    print(Row('growth of memory', LARGEST_GROWTH, False,
              max(memory[-third:]) - max(memory[:third]), 'MB', command))


if __name__ == '__main__':
    main()
