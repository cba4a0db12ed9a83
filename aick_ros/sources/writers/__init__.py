# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Writers of recorded RGB-D data, one a file, each taking any :class:`RgbdSource`."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Told how many frames are written, and how many there are at most."""


def no_progress(written: int, total: int) -> None:
    """Tell nobody."""
