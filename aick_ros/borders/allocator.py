# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Memory for images, which come and go with each frame."""

from __future__ import annotations

import ctypes

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _MOST_ARENAS = -1, -3, -8  # by definition of mallopt(3)
_LARGEST = 1 << 25  # [byte]; the most that glibc takes
_FREE = 1 << 26  # [byte]; chosen: all images of a few frames


def keep_freed_memory() -> None:
    """
    Let this process keep memory that it has freed, for the images of the next frame.

    By default glibc gives it back to the system, which has to clear it before it can be used
    again: a fifth of the processor time of a frame. What a thread has freed is kept for all, not
    for that thread alone; threads that began before go on as they were. Other C libraries are left
    as they are.
    """
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, _LARGEST)
        mallopt(_TRIM_THRESHOLD, _FREE)
        mallopt(_MOST_ARENAS, 1)


def release_freed_memory() -> None:
    """
    Give memory that is free back to the system, as of more images at once than usual.

    It takes some milliseconds, as the next frame does that uses it again.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
