#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Pin all that `make setup` and `make baselines` install, at the newest versions that go together.

Run it with the oldest Python that is supported: what has wheels for that one has them for the
newer ones too, seldom the other way round.
"""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / 'requirements' / 'constraints.txt'
HEADER = """\
# Every package that `make setup` and `make baselines` install, for Python 3.11 and newer on Linux.
# Made by tools/renew_pins.py.
"""


def resolve(requirement: str) -> list[str]:
    """Return what pip would install for a requirement, as ``name==version``, sorted."""
    report = subprocess.run(
        [sys.executable, '-m', 'pip', 'install', '--dry-run', '--ignore-installed', '--quiet',
         '--report', '-', requirement], check=True, stdout=subprocess.PIPE).stdout
    found = [package['metadata'] for package in json.loads(report)['install']]
    return sorted(f'{package["name"].lower()}=={package["version"]}'
                  for package in found if package['name'] != 'aick_ros')


def main() -> None:
    """Write the pins."""
    PINS.write_text(HEADER + '\n'.join(resolve(f'{ROOT}[ros,eval,baselines,test]')) + '\n')


if __name__ == '__main__':
    main()
