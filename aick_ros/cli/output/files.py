# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files written completely or not at all."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from aick_ros.cli.output.json_text import json_text
from aick_ros.cli.output.target import STANDARD_OUTPUT, reason_of
from aick_ros.errors import InputError

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
        if path.exists() and not path.is_file():
            path.write_bytes(content)  # by this name: what /dev/stdout leads to has none
            return
        path = path.resolve()
        draft = path.parent / draft.name
        draft.write_bytes(content)
        draft.replace(path)
    except (OSError, RuntimeError) as error:  # RuntimeError: a link to itself
        draft.unlink(missing_ok=True)
        raise InputError(f'cannot write {path}: {reason_of(error)}') from None


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
