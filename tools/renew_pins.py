#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Pin all that `make setup`, `make baselines`, `make mutation` and `make test-oldest` install.

The versions are the newest that go together, but for the oldest NumPy and OpenCV of the last one.

Run it with the oldest Python that is supported: what has wheels for that one has them for the
newer ones too, seldom the other way round.
"""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / 'requirements' / 'constraints.txt'
OLDEST_PINS = ROOT / 'requirements' / 'oldest.txt'
HEADER = """\
# Every package that `make setup`, `make baselines` and `make mutation` install, for Python 3.11
# and newer on Linux.
# Made by tools/renew_pins.py.
"""
OLDEST = ('numpy==1.26.4', 'opencv-python-headless==4.6.0.66')
OLDEST_HEADER = """\
# Every package that `make test-oldest` installs: NumPy and OpenCV of Ubuntu 24.04, Python 3.11.
# Made by tools/renew_pins.py.
"""


def resolve(*requirements: str) -> list[str]:
    """Return what pip would install for requirements, as ``name==version``, sorted."""
    report = subprocess.run(
        [sys.executable, '-m', 'pip', 'install', '--dry-run', '--ignore-installed', '--quiet',
         '--report', '-', *requirements], check=True, stdout=subprocess.PIPE).stdout
    found = [package['metadata'] for package in json.loads(report)['install']]
    return sorted(f'{package["name"].lower()}=={package["version"]}'
                  for package in found if package['name'] != 'aick_ros')


def main() -> None:
    """Write the pins of the newest packages and of the oldest NumPy and OpenCV."""
    extras = 'ros,eval,view,baselines,mutation,test'
    PINS.write_text(HEADER + '\n'.join(resolve(f'{ROOT}[{extras}]', 'pip')) + '\n')
    OLDEST_PINS.write_text(OLDEST_HEADER + '\n'.join(
        resolve(f'{ROOT}[ros,eval,test]', 'pip', *OLDEST)) + '\n')


if __name__ == '__main__':
    main()
