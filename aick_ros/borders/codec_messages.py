# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Silence of the image codecs, which print of damage that is reported as a sentence anyway."""

from __future__ import annotations

import ctypes
import functools
import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_LOCK = threading.Lock()
_silent_blocks = 0
_printing: int | None = None  # the stream to come back to


@contextmanager
def codecs_silenced() -> Iterator[None]:
    """
    Drop what C libraries print on ``stderr`` inside the block.

    Python's is another stream, and ROS keeps the one it began with: their messages are printed.
    Blocks of several threads may overlap. libpng and libjpeg in OpenCV have no option for it.
    Elsewhere than with glibc, whose stream is a variable, nothing happens.
    """
    nothing = _stream_to_nothing()
    if nothing is None:
        yield
        return
    _enter(nothing)
    try:
        yield
    finally:
        _leave()


def _enter(nothing: int) -> None:
    """Exchange the stream, if this is the first of the blocks that overlap."""
    global _silent_blocks, _printing
    with _LOCK:
        if not _silent_blocks:
            _printing, _stderr().value = _stderr().value, nothing
        _silent_blocks += 1


def _leave() -> None:
    """Exchange it back, if this is the last of them."""
    global _silent_blocks
    with _LOCK:
        _silent_blocks -= 1
        if not _silent_blocks:
            _stderr().value = _printing


@functools.cache
def _stderr() -> ctypes.c_void_p:
    """Return the variable ``stderr`` of the C library."""
    return ctypes.c_void_p.in_dll(ctypes.CDLL(None), 'stderr')


@functools.cache
def _stream_to_nothing() -> int | None:
    """Return a stream that stays open, as a library may hold it; None where there is none."""
    if platform.libc_ver()[0] != 'glibc':
        return None
    library = ctypes.CDLL(None)
    library.fopen.restype = ctypes.c_void_p
    stream: int | None = library.fopen(b'/dev/null', b'w')
    return stream
