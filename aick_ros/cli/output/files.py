# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files written completely or not at all."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from aick_ros.borders.replacement import replaced, unwritable
from aick_ros.cli.output.json_text import json_text
from aick_ros.cli.output.target import STANDARD_OUTPUT


def write_whole(path: Path, content: str | bytes) -> None:
    """
    Write a file atomically, as :func:`replaced` does.

    Text is written as UTF-8; bytes of names in it that are not UTF-8 are escaped.

    :raises InputError: where it cannot be written.
    """
    if isinstance(content, str):
        content = content.encode('utf-8', 'backslashreplace')
    with replaced(path) as draft:
        try:
            draft.write_bytes(content)
        except OSError as error:
            raise unwritable(path, error) from None


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
