# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Output streams of a program that may be closed, or lead to a full disk."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from aick_ros.borders.names import one_line


def open_streams() -> None:
    """Open the streams that are closed, or other files would take their descriptors."""
    while (opened := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(opened, True)
    os.close(opened)


def say(program: str, text: str) -> None:
    """Print one line on standard error, where that can be written to."""
    if sys.stderr is not None:
        with suppress(OSError):
            print(f'{program}: {one_line(text)}', file=sys.stderr, flush=True)


def flush_output() -> None:
    """Write what is left of the output; what cannot be written is dropped, or Python complains."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
