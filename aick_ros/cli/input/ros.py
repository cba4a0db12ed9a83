# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS 2, for the commands that need it."""

from __future__ import annotations

from aick_ros.errors import InputError, installation


def without_ros(error: ModuleNotFoundError) -> InputError:
    """Return the error of a command that requires ROS 2 where that is not installed."""
    return InputError(f'the node requires ROS 2, but {error.name} is missing: source a ROS 2 '
                      f"Jazzy workspace, or {installation('ros')}")
