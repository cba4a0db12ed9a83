# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of ``--plots``, checked before a long run."""

from __future__ import annotations

from pathlib import Path

from aick_ros.errors import InputError


def make_plot_folder(path: Path) -> None:
    """
    Make the folder, and check that plots can be drawn.

    :raises InputError: where the folder cannot be made or matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: F401: only whether it is installed
    except ModuleNotFoundError:
        raise InputError("--plots requires matplotlib: pip install 'aick_ros[eval]'") from None
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'--plots {path}: cannot make the folder: {error.strerror}') from None
