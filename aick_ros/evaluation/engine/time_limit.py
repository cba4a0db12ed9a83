# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The end of a process that hangs."""

from __future__ import annotations

import faulthandler
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO


@contextmanager
def time_limit(seconds: float, report: TextIO) -> Iterator[None]:
    """
    End the process with code 1 if the block takes longer, whatever it is doing.

    A library that hangs may hold the lock of the interpreter; the timer of faulthandler needs
    none. There is one per process: do not nest.

    :param report: file that the place where it hangs is written to.
    """
    if math.isfinite(seconds):
        faulthandler.dump_traceback_later(seconds, exit=True, file=report)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
