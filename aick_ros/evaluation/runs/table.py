# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of a fleet's runs, recordings x settings, as a Parquet file."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from aick_ros.borders.limits import MAX_LIST_BYTES, MAX_TABLE_CELLS
from aick_ros.errors import InputError, installation, package_of

Cell = str | int | float | bool | None
Row = Mapping[str, Cell]
"""Name of the column -> value; what a row lacks is None in the table."""

TABLE = 'table.parquet'
DONE, FAILED = 'done', 'failed'
"""Values of the column ``status``."""

UNUSED = 'unused_sensors'
"""Column that says of a run's sensors why they are not used; '' where all are."""

REMARKS = 'remarks'
"""Column of what a run's recording has said of its data, as of skipped images; '' for nothing."""

COVERED = 'trajectory.covered_frames'
"""Column of the number of frames that the ground truth covers; None without one."""

VARIED = 'set.'
"""Beginning of the names of the columns with settings that were varied."""


def table_bytes(rows: Sequence[Row]) -> bytes:
    """
    Return the content of the file of a table.

    :raises InputError: where pyarrow is missing.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError as error:
        raise _missing(error) from None
    columns = {_utf8(name): [_utf8(row.get(name)) for row in rows]
               for name in dict.fromkeys(name for row in rows for name in row)}
    content = io.BytesIO()
    pq.write_table(pa.table({name: pa.array(_of_one_type(values))
                             for name, values in columns.items()}), content)
    return content.getvalue()


def read_table(path: Path) -> list[Row]:
    """
    Read a whole table, as this package has written it.

    :raises InputError: where it cannot be read, or is too large.
    """
    with _errors_of(path) as pq, pq.ParquetFile(path) as file:
        _check_cells(path, file.metadata)
        rows: list[Row] = file.read().to_pylist()
        return rows


def read_texts(path: Path, columns: Sequence[str]) -> list[dict[str, str | None]]:
    """
    Read columns of text of a table, of which a few bytes of the file may be any amount.

    :raises InputError: where it cannot be read, is too large, or has no such columns.
    """
    with _errors_of(path) as pq:
        _check_columns(path, pq.read_schema(path), columns)
        # texts stay as they are packed, each of them once
        with pq.ParquetFile(path, read_dictionary=list(columns)) as file:
            _check_cells(path, file.metadata)
            content = file.read(list(columns))
        if sum(map(_text_bytes, content.columns)) > MAX_LIST_BYTES:
            raise InputError(f'the table {path} has more than {MAX_LIST_BYTES} bytes of text in '
                             f'{", ".join(columns)}: use it as aick fleet wrote it')
        rows: list[dict[str, str | None]] = content.to_pylist()
        return rows


@contextmanager
def _errors_of(path: Path) -> Iterator[Any]:
    """Give the module that reads a table; InputError where that fails in the block."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError as error:
        raise _missing(error) from None
    if path.exists() and not path.is_file():
        raise InputError(f'cannot read the table {path}: it is not a regular file')
    try:
        yield pq
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f'cannot read the table {path}: {str(error).splitlines()[0]}') from None


def _check_cells(path: Path, size: Any) -> None:
    if size.num_rows * size.num_columns > MAX_TABLE_CELLS:  # a few bytes are many rows
        raise InputError(f'the table {path} has more than {MAX_TABLE_CELLS} cells: '
                         'compare fewer runs')


def _check_columns(path: Path, schema: Any, columns: Sequence[str]) -> None:
    """Raise InputError where a schema of Arrow lacks a column of text, or has it twice."""
    for name in columns:
        kinds = [str(schema.field(place).type) for place in schema.get_all_field_indices(name)]
        if len(kinds) != 1 or not re.match('(large_|dictionary<values=)?string', kinds[0]):
            raise InputError(f'the table {path} has no column {name!r} of text: use it as aick '
                             'fleet wrote it')


def _text_bytes(column: Any) -> int:
    """Return the bytes of the texts of a column, which is packed as a dictionary."""
    from pyarrow import compute
    return sum(compute.sum(compute.binary_length(part.dictionary).take(part.indices)).as_py() or 0
               for part in column.chunks)


def _utf8(cell: Any) -> Any:
    """Return a cell; of text the bytes that are not UTF-8, as of names of files, are escaped."""
    return cell.encode(errors='backslashreplace').decode() if isinstance(cell, str) else cell


def _of_one_type(values: Sequence[Cell]) -> Sequence[Cell]:
    """Return the values of a column; as text where text is among other types."""
    kinds = {type(value) for value in values if value is not None}
    if len(kinds) > 1 and not kinds <= {int, float}:
        return [None if value is None else str(value) for value in values]
    return [float(value) if isinstance(value, int) else value for value in values] \
        if kinds == {int, float} else values


def _missing(error: ModuleNotFoundError) -> InputError:
    return InputError(f"no table without {package_of(error)}: {installation('fleet')}")
