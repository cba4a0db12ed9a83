# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Folders that options name, made before a long run."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from aick_ros.borders.replacement import try_to_write
from aick_ros.errors import InputError, installation


def make_plot_folder(path: Path) -> None:
    """
    Make the folder of ``--plots``, and check that plots can be drawn.

    :raises InputError: where the folder cannot be made or matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: F401: only whether it is installed
    except ModuleNotFoundError:
        raise InputError(f"--plots requires matplotlib: {installation('eval')}") from None
    make_folder(path, '--plots')


def make_folder(path: Path, option: str) -> None:
    """
    Make the folder that an option names.

    :raises InputError: where it cannot be made, or a file in it.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'{option} {path}: cannot make the folder: {error.strerror}; '
                         'name another folder') from None
    except RecursionError:  # of Path.mkdir
        raise InputError(f'{option} {path}: it has too many folders') from None
    try:
        try_to_write(path / 'file')
    except OSError as error:
        raise InputError(f'{option} {path}: cannot write into the folder: {error.strerror}; '
                         'name another folder, or make room there') from None


@contextmanager
def removed_if_empty(*paths: Path | None) -> Iterator[None]:
    """Remove folders that the block makes and leaves empty, as where the command fails."""
    new = [folder for path in paths if path is not None for folder in (path, *path.parents)
           if not os.path.lexists(folder)]
    try:
        yield
    finally:
        for folder in new:  # from within
            with suppress(OSError):
                folder.rmdir()
