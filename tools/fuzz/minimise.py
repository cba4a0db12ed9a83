# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A failing input made small."""

from __future__ import annotations

from collections.abc import Callable


def minimise(data: bytes, fails: Callable[[bytes], bool], most_trials: int = 400) -> bytes:
    """
    Return an input that fails too and from which no part can be removed, or zeroed.

    Parts are halved as long as nothing can be removed (delta debugging, Zeller 1999).

    :param fails: whether an input still fails in the same way.
    """
    trials = most_trials

    def attempt(candidate: bytes) -> bool:
        nonlocal trials
        trials -= 1
        return trials > 0 and candidate != data and fails(candidate)

    for fill in (b'', b'\0'):
        length = max(len(data) // 2, 1)
        while length and trials > 0:
            start = 0
            while start < len(data) and trials > 0:
                part = len(data[start:start + length])
                candidate = data[:start] + fill * part + data[start + part:]
                if attempt(candidate):
                    data = candidate
                    start += len(fill) * part
                else:
                    start += length
            length //= 2
    return data
