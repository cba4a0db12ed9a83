# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Threads that libraries start for one call: none, unless the user wants them."""

from __future__ import annotations

import os

ONE_THREAD = {name: '1' for name in (
    'OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMEXPR_NUM_THREADS',
    'OPENCV_FOR_THREADS_NUM')}
"""Environment of a process in which each library computes on the thread that called it."""


def one_thread_per_call() -> None:
    """
    Let libraries compute on the thread that calls them, unless the user has set their variables.

    Our matrices are small, and frames have a thread each for preparing and registering: more
    threads wait for each other, which costs a fifth of the node's processor time on two cores. To
    be called before NumPy and OpenCV are imported, which read the variables.
    """
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
