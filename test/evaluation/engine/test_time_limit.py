# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Processes that end within a limit, and those that do not."""

import subprocess
import sys

import pytest

PROGRAM = '''
import sys, time
from aick_ros.evaluation.engine.time_limit import time_limit
with open(sys.argv[1], 'w') as report:
    try:
        with time_limit({limit}, report):
            {block}
    except ValueError:
        pass
    time.sleep({after})
print('still here')
'''


@pytest.mark.parametrize('limit, block, after, code', [
    ('0.2', 'time.sleep(60)', 0, 1), ('0.2', 'pass', 0.5, 0), ('0.2', 'raise ValueError', 0.5, 0),
    ('float("inf")', 'time.sleep(0.1)', 0, 0)])
def test_the_block_alone_is_limited(tmp_path, limit, block, after, code):
    path = tmp_path / 'report'
    ended = subprocess.run([sys.executable, '-c', PROGRAM.format(
        limit=limit, block=block, after=after), str(path)], capture_output=True, text=True)
    assert ended.returncode == code
    assert ended.stdout == ('' if code else 'still here\n')
    assert path.read_text().startswith('Timeout') == bool(code)
