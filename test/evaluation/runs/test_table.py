# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tables written and read again."""

import os
from pathlib import Path

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.runs import table as runs_table
from aick_ros.evaluation.runs.table import read_table, read_texts, table_bytes

pytest.importorskip('pyarrow', reason="no tables: pip install '.[fleet]'")


def again(tmp_path, rows):
    (tmp_path / 'table').write_bytes(table_bytes(rows))
    return read_table(tmp_path / 'table')


def test_rows_come_back_and_what_one_lacks_is_none(tmp_path):
    rows = [{'a': 1, 'b': 'x'}, {'b': 'y', 'c': 0.5}, {'c': None, 'd': True}]
    assert again(tmp_path, rows) == [
        {'a': 1, 'b': 'x', 'c': None, 'd': None}, {'a': None, 'b': 'y', 'c': 0.5, 'd': None},
        {'a': None, 'b': None, 'c': None, 'd': True}]


@pytest.mark.parametrize('values, expected', [
    ([1, 2.5, None], [1.0, 2.5, None]), ([1, 'two', None], ['1', 'two', None]),
    ([True, 2, None], ['True', '2', None]), ([None, None], [None, None]),
    ([2 ** 60 + 1, None], [2 ** 60 + 1, None])])
def test_a_column_has_one_type(tmp_path, values, expected):
    found = [row['a'] for row in again(tmp_path, [{'a': value} for value in values])]
    assert found == expected and list(map(type, found)) == list(map(type, expected))


def test_text_that_is_not_utf_8_is_escaped(tmp_path):
    assert again(tmp_path, [{'\udcff': 'größe'}, {'\udcff': 'a\udcfe'}]) == [
        {r'\udcff': 'größe'}, {r'\udcff': r'a\udcfe'}]


@pytest.mark.parametrize('content', [None, b'', b'no table'])
def test_a_file_that_is_no_table_is_named(tmp_path, content):
    path = tmp_path / 'table'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=f'cannot read the table {path}: ') as caught:
        read_table(path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('make', [
    os.mkfifo, Path.mkdir, lambda path: path.symlink_to('/dev/zero')])
def test_what_may_never_end_is_rejected(tmp_path, make):
    make(path := tmp_path / 'table.parquet')
    for read in (read_table, lambda path: read_texts(path, ['a'])):
        with pytest.raises(InputError, match=f'^cannot read the table {path}: it is not a regular '
                                             'file$'):
            read(path)


def test_columns_of_text(tmp_path):
    path = tmp_path / 'table.parquet'
    path.write_bytes(table_bytes([{'a': 1, 'b': 'x', 'c': 'größe'}, {'a': 2, 'c': ''}]))
    assert read_texts(path, ['c', 'b']) == [{'c': 'größe', 'b': 'x'}, {'c': '', 'b': None}]
    for missing in ('a', 'd'):
        with pytest.raises(InputError) as raised:
            read_texts(path, ['b', missing])
        assert str(raised.value) == (f'the table {path} has no column {missing!r} of text: use it '
                                     'as aick fleet wrote it')


@pytest.mark.parametrize('make', [lambda pa: pa.nulls(2), lambda pa: pa.array([b'\xff', b'']),
                                  lambda pa: pa.array([['x'], []])])
def test_columns_of_other_types_are_rejected(tmp_path, make):
    import pyarrow as pa
    import pyarrow.parquet as pq
    pq.write_table(pa.table({'a': make(pa)}), path := tmp_path / 'table.parquet')
    with pytest.raises(InputError, match="has no column 'a' of text"):
        read_texts(path, ['a'])


def test_texts_that_are_packed_well_are_rejected_before_they_take_memory(tmp_path):
    """Of 100 kB, each row is the same megabyte."""
    import pyarrow as pa
    import pyarrow.parquet as pq
    packed = pa.DictionaryArray.from_arrays(pa.array([0] * 60_000, pa.int32()), ['x' * 10 ** 6])
    for name in ('a', 'b'):
        pq.write_table(pa.table({name: packed, 'c': packed.indices.cast(pa.string())}),
                       path := tmp_path / f'{name}.parquet')
        assert path.stat().st_size < 200_000
    with pytest.raises(InputError, match='has more than 67108864 bytes of text in c, b: use it'):
        read_texts(path, ['c', 'b'])
    assert read_texts(path, ['c']) == [{'c': '0'}] * 60_000


@pytest.mark.parametrize('limit, is_too_large', [(20, False), (19, True)])
def test_a_table_has_a_limit(tmp_path, monkeypatch, limit, is_too_large):
    """Some megabytes may be any number of equal rows."""
    monkeypatch.setattr(runs_table, 'MAX_TABLE_CELLS', limit)
    rows = 10 * [{'a': 1, 'b': 'x'}]
    path = tmp_path / 'table.parquet'
    path.write_bytes(table_bytes(rows))
    if is_too_large:
        with pytest.raises(InputError) as raised:
            read_table(path)
        assert str(raised.value) == f'the table {path} has more than 19 cells: compare fewer runs'
        with pytest.raises(InputError, match='has more than 19 cells: compare fewer runs'):
            read_texts(path, ['b'])
    else:
        assert read_table(path) == rows
