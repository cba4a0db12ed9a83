# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Servers that answer with an error, or not to the end, are asked again."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from aick_ros.cli.fleet.pace import SilentServerError
from aick_ros.errors import TransferError

_ATTEMPTS = 3  # chosen
_PAUSE = 1.0  # [s] before the second attempt, twice that before the third; chosen

Parameters = ParamSpec('Parameters')
Value = TypeVar('Value')


def asked_again(ask: Callable[Parameters, Value]) -> Callable[Parameters, Value]:
    """
    Return a function that is called again after a TransferError, which it raises at last.

    A SilentServerError is raised at once: the time that was waited for it was for all attempts.
    """
    @functools.wraps(ask)
    def asked(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Value:
        for attempt in range(_ATTEMPTS - 1):
            try:
                return ask(*args, **kwargs)
            except SilentServerError:
                raise
            except TransferError:
                time.sleep(_PAUSE * 2 ** attempt)
        return ask(*args, **kwargs)
    return asked
