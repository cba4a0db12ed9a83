# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Limits to the open files of a process (ulimit -n), under which imports and DDS fail."""

from __future__ import annotations

import resource

from aick_ros.errors import InputError


def check_open_files(required: int, user: str) -> None:
    """
    Check, before libraries open files and sockets, that they may.

    :param required: number of files and sockets.
    :param user: noun phrase for the error message, in the plural.
    :raises InputError: where fewer are allowed.
    """
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if allowed != resource.RLIM_INFINITY and allowed < required:
        raise InputError(f'a process may have {allowed} open files (ulimit -n), {user} require '
                         f'{required}: raise the limit')
