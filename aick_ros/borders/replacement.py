# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files that take the place of earlier ones when they are complete."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from aick_ros.errors import InputError

_DRAFT_NAME = 60  # characters of the name of a file in that of its draft; chosen
_SMALL = 4096  # bytes, a block of most disks; chosen


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """
    Give the path of a draft, which takes the place of a file when the block ends without error.

    So no reader finds a part of the file, and an earlier one stays where the block fails. Links
    are followed. A pipe or a device is written to directly.

    :raises InputError: where the file cannot be replaced, or is a pipe that no program reads.
    """
    try:
        is_direct = path.exists() and not path.is_file()
        target = path if is_direct else path.resolve()  # what /dev/stdout leads to has no name
    except (OSError, RuntimeError) as error:  # RuntimeError: a link to itself
        raise unwritable(path, error) from None
    if is_direct:
        with _read_by_a_program(path):
            yield path
        return
    draft = _draft_of(target, path.name)
    try:
        yield draft
        draft.replace(target)
    except OSError as error:
        if error.filename not in (draft, str(draft)):
            raise  # the block failed elsewhere
        raise unwritable(path, error) from None
    finally:
        with suppress(OSError):
            draft.unlink()


def try_to_write(path: Path) -> None:
    """
    Write and remove a small draft of a file, to find before a long run that it cannot be written.

    :param path: of nothing, or of a file, which stays as it is.
    :raises OSError: where its folder is read-only, or the disk full.
    """
    draft = _draft_of(path.resolve(), path.name)
    try:
        draft.write_bytes(bytes(_SMALL))
    finally:
        with suppress(OSError):
            draft.unlink()


def _draft_of(target: Path, name: str) -> Path:
    # not the whole name: with more characters it could be too long
    return target.parent / f'.{name[:_DRAFT_NAME]}.{os.getpid()}'


@contextmanager
def _read_by_a_program(path: Path) -> Iterator[None]:
    """Raise InputError for a pipe that nobody reads; who opens it would wait, perhaps for ever."""
    if not path.is_fifo():
        yield
        return
    try:
        opened = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except OSError:
        raise InputError(f'cannot write {path}: it is a pipe that no program reads') from None
    try:
        yield  # open until the block has it open, or the reader would find its end
    finally:
        os.close(opened)


def unwritable(path: Path | str, error: Exception) -> InputError:
    """Return the error of a file that cannot be written, with what to do."""
    return InputError(f'cannot write {path}: {reason_of(error)}; {_remedy(error)}')


def _remedy(error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.ENOSPC, errno.EDQUOT):
        return 'make room there'
    is_of_name = number == errno.ENAMETOOLONG or isinstance(error, ValueError)  # a NUL in it
    return f"choose another {'name' if is_of_name else 'place'}"


def reason_of(error: Exception) -> str:
    """Return why a file cannot be written, without its name."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
