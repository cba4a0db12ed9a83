# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files written completely or not at all."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from aick_ros.cli.output.json_text import json_text
from aick_ros.errors import InputError

STANDARD_OUTPUT = '-'


def write_whole(path: Path, content: str | bytes) -> None:
    """
    Write a file atomically, so that no reader finds a part of it; links are followed.

    A pipe or a device is written to directly.

    :raises InputError: where it cannot be written.
    """
    content = content.encode('utf-8') if isinstance(content, str) else content
    path = path.resolve()
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(content)
            return
        draft.write_bytes(content)
        draft.replace(path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise InputError(f'cannot write {path}: {error.strerror}') from None


def check_target(target: str | None) -> None:
    """
    Check before a long run that its JSON can be written.

    :param target: a file, ``-`` for standard output, None for nothing.
    :raises InputError: where the folder of the file does not exist.
    """
    if target not in (None, STANDARD_OUTPUT) and not Path(target).parent.is_dir():
        raise InputError(f'cannot write {target}: the folder {Path(target).parent} does not exist')


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
