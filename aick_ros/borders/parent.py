# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Processes that end with the one that started them, however that ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PARENT = 'AICK_PARENT_PROCESS'  # environment variable
_PR_SET_PDEATHSIG = 1  # by definition, prctl(2)


def supervised() -> dict[str, str]:
    """Return the environment for a process that is to end with this one."""
    return {**os.environ, _PARENT: str(os.getpid())}


def end_with_parent(ending: signal.Signals = signal.SIGKILL) -> None:
    """
    Let Linux signal this process when its parent ends; call it first.

    Without the environment of :func:`supervised`, nobody supervises this process, and nothing
    happens. The signal comes when the thread ends that started this process: it must wait for it.
    """
    if _PARENT not in os.environ:
        return
    prctl = getattr(ctypes.CDLL(None), 'prctl', None)
    if prctl is not None:
        prctl(_PR_SET_PDEATHSIG, ending)
    if os.environ.pop(_PARENT) != str(os.getppid()):  # it has ended before
        sys.exit(1)
