# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder that appears complete or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aick_ros.errors import InputError


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """
    Yield a path to write a folder at, and move it to ``path`` after success.

    Until then it is inside a hidden folder beside ``path``, which is removed where writing fails
    or is interrupted.

    :raises InputError: where ``path`` exists already or cannot be written.
    """
    if path.exists():
        raise InputError(f'{path} exists already: remove it or choose another name')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden = Path(tempfile.mkdtemp(prefix=f'.{path.name}.', dir=path.parent))
    except OSError as error:
        raise InputError(f'cannot write {path}: {error.strerror}') from None
    try:
        yield hidden / path.name
        (hidden / path.name).rename(path)
    except OSError as error:
        raise InputError(f'cannot write {path}: {error}') from None
    finally:
        shutil.rmtree(hidden, ignore_errors=True)
