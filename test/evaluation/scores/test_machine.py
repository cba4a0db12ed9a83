# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Facts of the machine against what the system and the libraries say."""

import os
import platform
import subprocess
import sys

import cv2
import numpy as np

from aick_ros.evaluation.scores import machine
from aick_ros.evaluation.scores.machine import machine_facts, peak_memory_mb

GROWS = '''
import numpy as np
from aick_ros.evaluation.scores.machine import peak_memory_mb
before = peak_memory_mb()
np.ones(25_000_000)
print(before, peak_memory_mb())
'''


def test_versions_and_cores_are_those_of_this_process():
    facts = machine_facts()
    assert (facts['numpy'], facts['opencv']) == (np.__version__, cv2.__version__)
    assert facts['python'] == '.'.join(map(str, sys.version_info[:3]))
    assert facts['cores'] == len(os.sched_getaffinity(0))
    assert facts['system'] == f'{platform.system()} {platform.machine()}'
    assert 'cpu' in facts and 'aick_ros' in facts


def test_who_changes_the_facts_changes_a_copy():
    machine_facts()['numpy'] = 'none'
    assert machine_facts()['numpy'] == np.__version__


def test_the_peak_is_that_of_the_process_alone_in_megabytes_and_stays():
    """200 MB are in use for a moment, in a process that a larger one may have started."""
    before, after = map(float, subprocess.run(
        [sys.executable, '-c', GROWS], capture_output=True, text=True, check=True).stdout.split())
    assert 190 < after - before < 230
    assert peak_memory_mb() >= int(open('/proc/self/statm').read().split()[1]) * 4096 / 1e6


def test_without_proc_the_peak_is_that_of_the_system(monkeypatch):
    monkeypatch.setattr(machine.resource, 'getrusage', lambda _: type('Usage', (), {
        'ru_maxrss': 2000})())

    def missing(*_):
        raise OSError
    monkeypatch.setattr(machine.Path, 'read_text', missing)
    assert peak_memory_mb() == 2.048
