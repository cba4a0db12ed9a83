# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The threads that libraries start in our programs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from aick_ros.borders.threads import ONE_THREAD

ROOT = Path(__file__).parents[2]
COMMAND_LINE = """
import sys
from aick_ros.cli import main
sys.argv = ['aick', '--version']
try:
    main()
except SystemExit:
    pass
"""


@pytest.mark.parametrize('start', [COMMAND_LINE, 'import aick_ros.ros'])
@pytest.mark.parametrize('wanted, threads', [({}, '1'), ({'OPENCV_FOR_THREADS_NUM': '2'}, '2')])
def test_opencv_uses_one_thread_unless_the_user_wants_more(start, wanted, threads):
    untouched = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    process = subprocess.run(
        [sys.executable, '-c', f'{start}\nimport cv2\nprint(cv2.getNumThreads())'],
        env={**untouched, **wanted, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True,
        check=True)
    assert process.stdout.splitlines()[-1] == threads


@pytest.mark.parametrize('start', [COMMAND_LINE, 'import aick_ros.ros'])
def test_all_others_are_asked_for_one_thread(start):
    untouched = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    process = subprocess.run(
        [sys.executable, '-c', f'{start}\nimport os\nprint(dict(os.environ))'],
        env={**untouched, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True, check=True)
    for name in ONE_THREAD:
        assert f"'{name}': '1'" in process.stdout
