# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of a fleet: ``runs/VARIANT/RECORDING/`` for each run, and the table of all."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath

from aick_ros.borders.bounded_json import bounded_json
from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.borders.replacement import unwritable
from aick_ros.cli.output.files import write_whole
from aick_ros.cli.output.plot_folder import make_folder
from aick_ros.errors import InputError
from aick_ros.evaluation.runs.table import (
    DONE, REMARKS, TABLE, UNUSED, VARIED, Cell, Row, table_bytes)

ROW = 'row.json'
"""File in the folder of a run with its row of the table; a run without it has not ended."""

_REQUIRED = {'source', 'variant', 'run', 'identity', 'status'}
_TEXTS = _REQUIRED | {'recording', 'cause', 'reason', 'worker', 'ended', UNUSED, REMARKS}
"""Columns of text; the others are of numbers, or of settings."""

_LONGEST = 100  # characters of a folder's name; chosen

Key = tuple[str, str]
"""Source and variant of a run."""


class Results:
    """
    Runs that have ended, those of earlier commands included.

    :param folder: it is made where it does not exist.
    :raises InputError: where it cannot be made, written or read.
    """

    def __init__(self, folder: Path) -> None:
        table_bytes([])  # before a long run: is pyarrow there?
        self.folder, self.rows = folder, dict[Key, Row]()
        self._paths: dict[str, Key] = {}
        try:
            make_folder(folder, '--out')
            make_folder(folder / 'runs', '--out')
            paths = sorted((folder / 'runs').glob(f'*/*/{ROW}'))
        except OSError as error:
            raise InputError(f'cannot read the folder {folder}: {error.strerror}; name another '
                             'one with --out') from None
        for path in paths:
            row = _read(path)
            key = str(row['source']), str(row['variant'])
            self.rows[key], self._paths[str(row['run'])] = row, key

    def has(self, key: Key, identity: str) -> bool:
        """Return whether a run has ended that would be the same again."""
        return key in self.rows and self.rows[key]['identity'] == identity

    def is_done(self, key: Key) -> bool:
        """Return whether a run has ended well, of whatever content and settings."""
        return key in self.rows and self.rows[key]['status'] == DONE

    def add(self, key: Key, row: Row, files: Mapping[str, bytes] = {}) -> None:
        """
        Write a run, whole or not at all, in place of an earlier one.

        :param row: without its folder.
        :param files: name -> content.
        """
        run = self._path(key)
        row = {**row, 'run': run}
        path = self.folder / run
        draft = path.with_name(f'.{path.name}')
        try:
            if draft.exists():
                shutil.rmtree(draft)
            draft.mkdir(parents=True)
            for name, content in {**files, ROW: json.dumps(row).encode()}.items():
                (draft / name).write_bytes(content)
            if path.exists():
                shutil.rmtree(path)
            draft.rename(path)
        except OSError as error:
            raise unwritable(error.filename or path, error) from None
        finally:
            shutil.rmtree(draft, ignore_errors=True)
        self.rows[key], self._paths[run] = row, key

    def write_table(self, keys: Iterable[Key]) -> list[Row]:
        """Write the table with the rows of some runs, those that have ended, and return these."""
        rows = [self.rows[key] for key in keys if key in self.rows]
        write_whole(self.folder / TABLE, table_bytes(rows))
        return rows

    def _path(self, key: Key) -> str:
        """Return the folder of a run, which no other run has, below that of the fleet."""
        source, variant = key
        name = PurePosixPath(source.rstrip('/')).name or 'recording'
        path = f'runs/{_file_name(variant)}/{_file_name(name)}'
        if self._paths.get(path, key) == key:
            return path
        return f'{path}-{hashlib.sha256(source.encode(errors="replace")).hexdigest()[:8]}'


def _file_name(text: str) -> str:
    return re.sub(r'[^A-Za-z0-9_.,=-]+', '_', text)[:_LONGEST].lstrip('.') or '_'


def _read(path: Path) -> Row:
    text = read_text(path, 'the row of a run', MAX_CONFIGURATION_BYTES)
    try:
        row = bounded_json(text)
        if not _REQUIRED <= row.keys() or not all(map(_is_cell, row, row.values())):
            raise ValueError
    except (ValueError, AttributeError):
        raise InputError(f'{path} is not the row of a run: remove its folder') from None
    result: Row = row
    return result


def _is_cell(column: str, value: Cell) -> bool:
    """Return whether a value is one of a column."""
    if column in _TEXTS:
        return isinstance(value, str)
    kinds = (int, float, str) if column.startswith(VARIED) else (int, float)
    return value is None or isinstance(value, kinds)
