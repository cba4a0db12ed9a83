# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Silence of the image codecs, which print of damage that is reported as a sentence anyway."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def codecs_silenced() -> Iterator[None]:
    """
    Drop what C libraries print on ``stderr`` inside the block; Python's is another stream.

    libpng and libjpeg in OpenCV have no option for it. Elsewhere than with glibc, whose stream is
    a variable, nothing happens.
    """
    if platform.libc_ver()[0] != 'glibc':
        yield
        return
    library = ctypes.CDLL(None)
    library.fopen.restype = ctypes.c_void_p
    stream = ctypes.c_void_p.in_dll(library, 'stderr')
    before, nothing = stream.value, library.fopen(b'/dev/null', b'w')
    if nothing is not None:  # too many open files
        stream.value = nothing
    try:
        yield
    finally:
        stream.value = before
        if nothing is not None:
            library.fclose(ctypes.c_void_p(nothing))
