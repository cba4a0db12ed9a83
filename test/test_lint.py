# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Style and types, checked as `make lint` does, so that whoever runs the tests runs them too."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize('command', [
    ('flake8',), ('isort', '--check-only', '--quiet', '.'),
    ('mypy', 'aick_ros', 'examples')], ids=lambda command: command[0])
def test_lint(command):
    pytest.importorskip(command[0])
    assert f'-m {" ".join(command)}\n' in (ROOT / 'Makefile').read_text()
    done = subprocess.run([sys.executable, '-m', *command], cwd=ROOT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
