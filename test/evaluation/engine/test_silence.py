# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A worker writes nothing, not even from C, and keeps no descriptor for that."""

import subprocess
import sys

CODE = """
import ctypes, os, sys
from aick_ros.evaluation.engine.silence import dask_setup
before = len(os.listdir('/proc/self/fd'))
dask_setup(None)
print('from Python', flush=True)
print('from Python', file=sys.stderr, flush=True)
ctypes.CDLL(None).puts(b'from C')
ctypes.CDLL(None).fflush(None)
os.write(2, b'from below')
sys.exit(before - len(os.listdir('/proc/self/fd')) + 40)
"""


def test_nothing_is_written():
    run = subprocess.run([sys.executable, '-c', CODE], capture_output=True)
    assert (run.returncode, run.stdout, run.stderr) == (40, b'', b'')
