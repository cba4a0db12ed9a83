# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Regular files of limited size, read whole."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from aick_ros.errors import InputError

_GROWTH = 2 ** 20  # [byte] beyond the size that a file reports, as those of /proc do; chosen


def read_bytes(path: Path, what: str, limit: int) -> bytes:
    """
    Return the content of a regular file.

    :param what: noun phrase for the error message, for example 'the list'.
    :param limit: largest size [byte].
    :raises InputError: where the file cannot be read, is too large, or is a pipe or a device,
        which may never end.
    """
    try:
        # without O_NONBLOCK, opening a pipe waits for a writer
        with open(path, 'rb', opener=lambda name, flags: os.open(
                name, flags | os.O_NONBLOCK)) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f'cannot read {what} {path}: it is not a regular file')
            if status.st_size > limit:
                raise _too_large(path, what, limit)
            most = min(limit, status.st_size + _GROWTH)
            content: bytes | None = file.read(most + 1)  # which takes as much memory at once
    except OSError as error:
        raise InputError(f'cannot read {what} {path}: {error.strerror}') from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f'cannot read {what} {path}: {error}') from None  # NUL in the name
    if content is None:  # as of /proc/kmsg, which calls itself a regular file
        raise InputError(f'cannot read {what} {path}: its content never ends')
    if len(content) > most:
        raise _too_large(path, what, most)
    return content


def _too_large(path: Path, what: str, limit: int) -> InputError:
    return InputError(f'cannot read {what} {path}: it is larger than {limit} bytes')


def read_text(path: Path, what: str, limit: int) -> str:
    """
    Return the text of a regular file in UTF-8, without the mark that some editors begin it with.

    The parameters are those of :func:`read_bytes`.

    :raises InputError: also where the file is not text.
    """
    try:
        return read_bytes(path, what, limit).decode('utf-8-sig')
    except UnicodeDecodeError as error:
        raise InputError(f'cannot read {what} {path}: byte {error.start} is not UTF-8 text'
                         ) from None
