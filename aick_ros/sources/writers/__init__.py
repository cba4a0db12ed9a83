# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Writers of RGB-D recordings, one per file, of any :class:`RgbdSource`."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Callback with the number of frames written so far, and an upper bound of their number."""


def no_progress(written: int, total: int) -> None:
    """Ignore the progress."""
