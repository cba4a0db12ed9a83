# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files that options name for results, checked before a long run."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

from aick_ros.borders.replacement import reason_of, try_to_write, unwritable
from aick_ros.errors import InputError

STANDARD_OUTPUT = '-'


def check_target(target: str | None, *inputs: str | Path | None) -> None:
    """
    Check before a long run that a file of results can be written, and replaces no input.

    :param target: a file, ``-`` for standard output, None for nothing.
    :param inputs: files and folders that the command reads; None and names of no file are skipped.
    :raises InputError: where the file cannot be made: its folder does not exist or is read-only,
        the disk is full, its name is too long, it is a folder, or it is an input or a file of one.
    """
    if target is None or target == STANDARD_OUTPUT:
        return
    path = Path(target)
    if not os.path.isdir(path.parent):
        raise InputError(f'cannot write {target}: the folder {path.parent} does not exist')
    try:
        with suppress(FileNotFoundError):
            mode = path.stat().st_mode
            if stat.S_ISDIR(mode):
                raise InputError(f'cannot write {target!r}: it is a folder, a file is required')
            if not stat.S_ISREG(mode):
                return  # what a pipe or a device is given cannot be taken back
            _check_inputs(path, [Path(name) for name in inputs if name])
        try_to_write(path)
    except (OSError, ValueError) as error:  # ValueError: NUL in the name
        if isinstance(error, InputError):
            raise
        raise unwritable(repr(target), error) from None


def check_parent(folder: Path, option: str) -> None:
    """
    Check before a long run that a folder of results can be made in a folder.

    :param folder: it is made later where it does not exist.
    :raises InputError: where it cannot be: what would hold it is no folder or cannot be written.
    :raises FileNotFoundError: where the current folder has been removed.
    """
    place = folder.absolute()
    existing = next(path for path in (place, *place.parents) if os.path.lexists(path))
    try:
        try_to_write(existing / 'file')
    except (OSError, ValueError, RuntimeError) as error:  # NUL in the name; a link to itself
        raise InputError(f'{option} {folder}: cannot make a folder in {existing}: '
                         f'{reason_of(error)}; name another folder') from None


def _check_inputs(path: Path, inputs: list[Path]) -> None:
    """Raise InputError where a file is an input, or one of an input's files."""
    for name in inputs:
        if not os.path.exists(name):
            continue
        if os.path.samefile(path, name):
            raise InputError(f'cannot write {path}: it is an input of this command; name another '
                             'file for the results')
        if os.path.isdir(name) and (path.resolve().is_relative_to(name.resolve())
                                    or _has_file(name, path)):
            raise InputError(f'cannot write {path}: it is a file of the input {name}; name '
                             'another file for the results')


def _has_file(folder: Path, path: Path) -> bool:
    """Return whether a file is in a folder or one level below it, where links may lead."""
    for place, folders, names in os.walk(folder, followlinks=True):
        files = (os.path.join(place, name) for name in names)
        if any(os.path.exists(file) and os.path.samefile(path, file) for file in files):
            return True
        if Path(place) != folder:
            folders.clear()
    return False
