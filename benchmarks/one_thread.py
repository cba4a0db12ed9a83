# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A benchmark whose linear algebra has one thread."""

from __future__ import annotations

import os
import sys

from aick_ros.borders.threads import ONE_THREAD


def restart_in_one_thread() -> None:
    """
    Start this script again with single-threaded BLAS and OpenMP, unless it has been.

    To be called before NumPy is imported: it reads its number of threads then.
    """
    if not os.environ.items() >= ONE_THREAD.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ONE_THREAD})
