# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The machine that a measurement was made on."""

from __future__ import annotations

import functools
import os
import platform
import resource
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import cv2
import numpy as np


def machine_facts() -> dict[str, str | int]:
    """Return what run times depend on: processor, cores, versions."""
    return dict(_facts())


@functools.cache
def _facts() -> dict[str, str | int]:
    """Return what does not change while a process runs, and takes some milliseconds to find."""
    return {
        'cpu': _cpu(),
        'cores': len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity')
        else os.cpu_count() or 1,
        'system': f'{platform.system()} {platform.machine()}',
        'python': platform.python_version(),
        'numpy': np.__version__,
        'opencv': cv2.__version__,
        'aick_ros': _installed_version(),
    }


def peak_memory_mb() -> float:
    """Return the largest resident memory of this process so far [MB]."""
    kibibytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:  # on Linux that is at least the memory of the process that started this one
        status = Path('/proc/self/status').read_text()
    except OSError:
        return kibibytes * 1024 / 1e6
    peaks = (line.split()[1] for line in status.splitlines() if line.startswith('VmHWM:'))
    return int(next(peaks, kibibytes)) * 1024 / 1e6


def _installed_version() -> str:
    try:
        return version('aick_ros')
    except PackageNotFoundError:
        return 'not installed'


def _cpu() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(':')[2].strip() for line in lines if line.startswith('model name'))
    return next(names, platform.processor())
