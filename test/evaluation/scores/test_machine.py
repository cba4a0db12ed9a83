# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Facts of the machine against what the system and the libraries say."""

import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

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


@pytest.mark.parametrize('text, name', [
    ('processor\t: 0\nmodel name\t: A: CPU @ 3 GHz\nmodel name\t: other\n', 'A: CPU @ 3 GHz'),
    ('processor\t: 0\nBogoMIPS\t: 48\n', 'by the system'), (None, 'by the system')])
def test_the_processor_is_named_by_the_kernel_or_else_by_the_system(monkeypatch, text, name):
    def read(path):
        assert str(path) == '/proc/cpuinfo'
        if text is None:
            raise OSError
        return text
    monkeypatch.setattr(machine, 'version', lambda name: '7')  # which reads files, too
    monkeypatch.setattr(machine.Path, 'read_text', read)
    monkeypatch.setattr(machine.platform, 'processor', lambda: 'by the system')
    assert machine._facts.__wrapped__()['cpu'] == name


def test_a_package_that_is_not_installed_has_no_version(monkeypatch):
    monkeypatch.setattr(machine, 'version', lambda name: f'{name} 7')
    assert machine._facts.__wrapped__()['aick_ros'] == 'aick_ros 7'

    def missing(name):
        raise PackageNotFoundError
    monkeypatch.setattr(machine, 'version', missing)
    assert machine._facts.__wrapped__()['aick_ros'] == 'not installed'


@pytest.mark.parametrize('count, cores', [(3, 3), (None, 1)])
def test_where_no_cores_are_assigned_all_count(monkeypatch, count, cores):
    monkeypatch.delattr(machine.os, 'sched_getaffinity')
    monkeypatch.setattr(machine.os, 'cpu_count', lambda: count)
    assert machine._facts.__wrapped__()['cores'] == cores


@pytest.mark.parametrize('status, peak', [
    ('VmPeak:\t 9 kB\nVmHWM:\t 5000 kB\nVmRSS:\t 4 kB\n', 5.12), ('VmRSS:\t 4 kB\n', 2.048)])
def test_the_peak_is_that_of_the_resident_memory(monkeypatch, status, peak):
    monkeypatch.setattr(machine.resource, 'getrusage', lambda _: SimpleNamespace(ru_maxrss=2000))
    monkeypatch.setattr(machine.Path, 'read_text', lambda *_: status)
    assert peak_memory_mb() == pytest.approx(peak)
