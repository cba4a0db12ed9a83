# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Limits to the memory of a process (ulimit -v, -d), under which libraries in C end it."""

from __future__ import annotations

import resource

from aick_ros.errors import InputError

_PER_DATA = 2  # addresses, those of code included, per byte of data; measured: more than two


def check_address_space(required: int, user: str) -> None:
    """
    Check, before libraries allocate memory, that they may: they abort where they may not.

    :param required: bytes of addresses, most of which are reserved and never used.
    :param user: noun phrase for the error message, in the plural.
    :raises InputError: where fewer are allowed.
    """
    for kind, option, least in ((resource.RLIMIT_AS, '-v', required),
                                (resource.RLIMIT_DATA, '-d', required // _PER_DATA)):
        allowed, _ = resource.getrlimit(kind)
        if allowed != resource.RLIM_INFINITY and allowed < least:
            raise InputError(f'the memory of a process is limited to {allowed // 10 ** 6} MB '
                             f'(ulimit {option}), {user} require {least // 10 ** 6} MB: raise the '
                             'limit')
