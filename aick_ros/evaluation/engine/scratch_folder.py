# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Temporary folders; that of a command which was killed is removed by the next command."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aick_ros.errors import InputError

_PREFIX = 'aick-scratch-'


@contextmanager
def scratch_folder(parent: str | None = None) -> Iterator[Path]:
    """
    Give a new folder for the length of a block, locked while this process lives.

    :param parent: where it is made; None: in the system's folder of temporary files.
    :raises InputError: where it cannot be made.
    """
    folder, lock = _new_folder(Path(parent or tempfile.gettempdir()).absolute())
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _new_folder(parent: Path) -> tuple[Path, int]:
    """Return a new folder and its lock; those of processes that have ended are removed."""
    for path in parent.glob(f'{_PREFIX}*'):
        _remove_unlocked(path)
    try:
        parent.mkdir(parents=True, exist_ok=True)
        new = Path(tempfile.mkdtemp(prefix='aick-new-', dir=parent))
    except OSError as error:
        raise InputError(f'cannot make a folder in {parent}: {error.strerror}') from None
    lock = _lock(new)
    # renamed when it is locked: another command never finds it without
    return new.rename(parent / new.name.replace('aick-new-', _PREFIX)), lock


def _remove_unlocked(folder: Path) -> None:
    """Remove a folder unless its process lives, or it is another user's."""
    try:
        lock = _lock(folder)
    except OSError:
        return
    shutil.rmtree(folder, ignore_errors=True)
    os.close(lock)


def _lock(folder: Path) -> int:
    """
    Lock a folder and return its descriptor, which ends the lock when it is closed.

    :raises OSError: where another process has locked it, or it cannot be opened.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor
