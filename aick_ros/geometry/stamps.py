# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Stamps: integer nanoseconds since an epoch, as in the header of a ROS message."""

NANOSECONDS = 1_000_000_000
"""Nanoseconds in one second."""

MAX_STAMP = 2 ** 31 * NANOSECONDS - 1
"""Largest stamp of builtin_interfaces/Time [ns]; by definition."""

RESTART_AFTER = NANOSECONDS  # chosen: no camera or bus delivers images so late
"""A stamp that goes back by more than this [ns] starts a new recording; by less, it is late."""


def seconds(start: int, end: int) -> float:
    """Return the time between two stamps [s]."""
    return (end - start) / NANOSECONDS
