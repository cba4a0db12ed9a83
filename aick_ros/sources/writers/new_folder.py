# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder that appears complete or not at all."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aick_ros.borders.replacement import unwritable
from aick_ros.errors import InputError

_HIDDEN_NAME = 60  # characters of the name of a folder in that of the hidden one; chosen


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """
    Yield a path to write a folder at, and move it to ``path`` after success.

    Until then it is inside a hidden folder beside ``path``, which is removed where writing fails
    or is interrupted.

    :raises InputError: where ``path`` exists already or cannot be written.
    """
    check_new(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden = Path(tempfile.mkdtemp(prefix=f'.{path.name[:_HIDDEN_NAME]}.', dir=path.parent))
    except OSError as error:
        raise unwritable(path, error) from None
    except RecursionError:  # of Path.mkdir
        raise InputError(f'cannot write {path}: it has too many folders') from None
    try:
        yield hidden / path.name
        check_new(path)  # another command may have made it meanwhile
        (hidden / path.name).rename(path)
    except (OSError, sqlite3.Error) as error:  # sqlite3: a full disk
        raise unwritable(path, error) from None
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def check_new(path: Path) -> None:
    """
    Check before a long preparation that a folder does not exist.

    :raises InputError: where anything is at the path, or nothing can be.
    """
    try:
        path.lstat()
    except FileNotFoundError:
        return
    except OSError as error:
        raise unwritable(path, error) from None
    except ValueError as error:  # NUL in the name
        raise unwritable(repr(str(path)), error) from None
    raise InputError(f'{path} exists already: remove it or choose another name')
