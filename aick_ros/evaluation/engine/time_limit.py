# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The end of a process that hangs."""

from __future__ import annotations

import faulthandler
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """
    End the process with code 1 if the block takes longer, whatever it is doing.

    A library that hangs may hold the lock of the interpreter; the timer of faulthandler needs
    none. There is one per process: do not nest.
    """
    if not math.isfinite(seconds):
        yield
        return
    with open(os.devnull, 'w') as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
