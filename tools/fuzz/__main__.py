# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Give damaged inputs to all that reads input; anything but InputError is a finding.

Findings are minimised and kept as files; ``--replay FILE`` runs one again. Once mended, move the
file into seeds/TARGET/, so that it is tried first from then on.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import math
import secrets
import sys
import tempfile
import time
from pathlib import Path

import campaign
from targets import DECODERS, TARGETS
from worker import Worker

_SLICE = 6.0  # seconds of a target before the next has its turn, at most

if importlib.util.find_spec('rclpy'):
    from node_events import take_events
    TARGETS['node'] = take_events


def main() -> int:
    """Return 0 where nothing was found, 1 otherwise."""
    arguments = _arguments()
    if arguments.replay is not None:
        return _replay(arguments.replay)
    start, slices = time.monotonic(), []
    end = start + arguments.seconds
    names = arguments.target or list(TARGETS)
    for turn in itertools.count():
        for name in names:
            seconds = min(_SLICE, arguments.seconds / len(names), end - time.monotonic())
            if arguments.cases is not None:
                seconds = math.inf
            elif seconds <= 0.0:
                break
            slices.append(campaign.run_slice(
                name, TARGETS[name], f'{arguments.seed}.{turn}', seconds,
                arguments.cases or 10 ** 9))
            for path in campaign.keep(slices[-1:], arguments.keep):
                print(f'found: {path}', flush=True)
        if arguments.cases is not None or time.monotonic() >= end:
            break
    for name in names:
        parts = [part for part in slices if part.target == name]
        kinds = {kind for part in parts for kind in part.findings}
        print(f'{name:20} {sum(part.count for part in parts):8} inputs, {len(kinds)} findings '
              + ', '.join(sorted(kinds)))
    print(f'{sum(part.count for part in slices)} inputs in {time.monotonic() - start:.0f} s, '
          f'seed {arguments.seed}')
    return 1 if any(part.findings for part in slices) else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=600.0, help='time for all targets')
    parser.add_argument('--cases', type=int, help='inputs per target, instead of a time')
    parser.add_argument('--seed', default=secrets.token_hex(4),
                        help='of the damage; default: drawn at random, and printed')
    parser.add_argument('--target', action='append', choices=TARGETS, help='default: all')
    parser.add_argument('--keep', type=Path, default=Path('fuzz_findings'), metavar='FOLDER')
    parser.add_argument('--replay', type=Path, metavar='FILE',
                        help='run one input, of the target that its folder is named after')
    return parser.parse_args()


def _replay(path: Path) -> int:
    target = TARGETS[path.parent.name]
    with tempfile.TemporaryDirectory() as folder:
        outcome = Worker(target, Path(folder), path.parent.name in DECODERS).run(path.read_bytes())
    print(f'{outcome.finding or "no finding"}: {outcome.text}')
    return 1 if outcome.finding else 0


if __name__ == '__main__':
    sys.exit(main())
