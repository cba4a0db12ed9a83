# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files written completely or not at all."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from typing import Any

from aick_ros.cli.output.json_text import json_text
from aick_ros.errors import InputError

STANDARD_OUTPUT = '-'

_DRAFT_NAME = 60  # characters of the name of a file in that of its draft; chosen


def write_whole(path: Path, content: str | bytes) -> None:
    """
    Write a file atomically, so that no reader finds a part of it; links are followed.

    A pipe or a device is written to directly.

    :raises InputError: where it cannot be written.
    """
    content = content.encode('utf-8') if isinstance(content, str) else content
    # not the whole name: with more characters it could be too long
    draft = path.parent / f'.{path.name[:_DRAFT_NAME]}.{os.getpid()}'
    try:
        path = path.resolve()
        draft = path.parent / draft.name
        if path.exists() and not path.is_file():
            path.write_bytes(content)
            return
        draft.write_bytes(content)
        draft.replace(path)
    except (OSError, RuntimeError) as error:  # RuntimeError: a link to itself
        draft.unlink(missing_ok=True)
        raise InputError(f'cannot write {path}: {_reason(error)}') from None


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def check_target(target: str | None) -> None:
    """
    Check before a long run that its JSON can be written.

    :param target: a file, ``-`` for standard output, None for nothing.
    :raises InputError: where the file cannot be made: its folder does not exist, its name is too
        long, or it is a folder.
    """
    if target is None or target == STANDARD_OUTPUT:
        return
    path = Path(target)
    if not os.path.isdir(path.parent):
        raise InputError(f'cannot write {target}: the folder {path.parent} does not exist')
    try:
        if stat.S_ISDIR(path.stat().st_mode):
            raise InputError(f'cannot write {target!r}: it is a folder, a file is required')
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:  # ValueError: NUL in the name
        if isinstance(error, InputError):
            raise
        raise InputError(f'cannot write {target!r}: {_reason(error)}') from None


def write_json(target: str | Path, content: Any) -> None:
    """
    Write JSON.

    :param target: a file, or ``-`` for standard output.
    """
    text = json_text(content) + '\n'
    if target == STANDARD_OUTPUT:
        sys.stdout.write(text)
    else:
        write_whole(Path(target), text)
