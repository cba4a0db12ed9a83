# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of a process that gets no more memory, which Python and libraries report in many ways."""

from __future__ import annotations

import re

SENTENCE = 'the memory is full, or limited (ulimit): free some, or use fewer or smaller images'

_REASON = re.compile("map segment|allocate memory|Insufficient memory|can't start new thread")


def is_of_memory(error: BaseException) -> bool:
    """Return whether an operation failed for want of memory."""
    return isinstance(error, MemoryError) or bool(_REASON.search(str(error)))
