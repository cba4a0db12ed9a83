# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of a fleet's runs, recordings x settings, as a Parquet file."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from aick_ros.borders.limits import MAX_TABLE_CELLS
from aick_ros.errors import InputError, installation, package_of

Cell = str | int | float | bool | None
Row = Mapping[str, Cell]
"""Name of the column -> value; what a row lacks is None in the table."""

TABLE = 'table.parquet'
DONE, FAILED = 'done', 'failed'
"""Values of the column ``status``."""

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
    Read a table.

    :raises InputError: where it cannot be read, or is too large.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError as error:
        raise _missing(error) from None
    try:
        with pq.ParquetFile(path) as file:
            size = file.metadata
            if size.num_rows * size.num_columns > MAX_TABLE_CELLS:  # a few bytes are many rows
                raise InputError(f'the table {path} has more than {MAX_TABLE_CELLS} cells: '
                                 'compare fewer runs')
            rows: list[Row] = file.read().to_pylist()
    except (OSError, pa.ArrowException) as error:
        raise InputError(f'cannot read the table {path}: {str(error).splitlines()[0]}') from None
    return rows


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
