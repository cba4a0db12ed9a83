# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The folder of a fleet: whole runs, each in a folder of its own."""

import errno
import json
import os
from pathlib import Path

import pytest

from aick_ros.cli.fleet.results import Results
from aick_ros.errors import InputError
from aick_ros.evaluation.runs.table import read_table


def row(source, identity='x', **cells):
    return {'source': source, 'variant': 'a=1', 'identity': identity, 'status': 'done', **cells}


def test_recordings_of_one_name_have_folders_of_their_own(tmp_path):
    results = Results(tmp_path)
    keys = [(source, 'a=1') for source in ('mon/bag', 'tue/bag', 's3://x/bag?a=<b>')]
    for key in keys:
        results.add(key, row(key[0]), {'name.txt': key[0].encode()})
    results.add(keys[0], row(keys[0][0], 'y'), {'name.txt': b'again'})
    again = Results(tmp_path)
    assert again.rows == results.rows
    assert len({str(again.rows[key]['run']) for key in keys}) == 3
    texts = [(tmp_path / again.rows[key]['run'] / 'name.txt').read_text() for key in keys]
    assert texts == ['again', 'tue/bag', 's3://x/bag?a=<b>']
    assert again.has(keys[0], 'y') and not again.has(keys[0], 'x')


def test_a_run_stays_where_the_next_one_cannot_be_written(tmp_path, monkeypatch):
    results, key = Results(tmp_path), ('bag', 'a=1')
    results.add(key, row('bag'), {'name.txt': b'earlier'})
    write = Path.write_bytes

    def write_some(path, content):
        write(path, content[:1])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(Path, 'write_bytes', write_some)
        with pytest.raises(InputError, match='cannot write .*runs/a=1/bag: No space left'):
            results.add(key, row('bag', 'y'), {'name.txt': b'next'})
    again = Results(tmp_path)
    assert again.has(key, 'x')
    assert (tmp_path / again.rows[key]['run'] / 'name.txt').read_text() == 'earlier'
    assert os.listdir(tmp_path / 'runs' / 'a=1') == ['bag']


def test_a_table_has_the_columns_of_all_rows(tmp_path):
    results = Results(tmp_path)
    results.add(('1', 'a=1'), row('1', count=1, mixed=1))
    results.add(('2', 'a=1'), row('2', error=0.1, count=0.5, mixed='none'))
    results.write_table([('2', 'a=1'), ('1', 'a=1'), ('3', 'a=1')])
    rows = read_table(tmp_path / 'table.parquet')
    assert [(r['source'], r['count'], r['mixed'], r['error']) for r in rows] == [
        ('2', 0.5, 'none', 0.1), ('1', 1.0, '1', None)]


@pytest.mark.parametrize('text', ['', '[]', '{"source": "a"}', '{"source": '])
def test_a_damaged_row_is_named(tmp_path, text):
    (tmp_path / 'runs' / 'a' / 'b').mkdir(parents=True)
    (tmp_path / 'runs' / 'a' / 'b' / 'row.json').write_text(text)
    with pytest.raises(InputError, match='row.json is not the row of a run'):
        Results(tmp_path)


@pytest.mark.parametrize('missing', ['source', 'variant', 'run', 'identity', 'status'])
def test_a_row_without_what_identifies_its_run_is_named(tmp_path, missing):
    (tmp_path / 'runs' / 'a' / 'b').mkdir(parents=True)
    content = {**row('bag'), 'run': 'runs/a/b'}
    del content[missing]
    (tmp_path / 'runs' / 'a' / 'b' / 'row.json').write_text(json.dumps(content))
    with pytest.raises(InputError, match='row.json is not the row of a run: remove its folder'):
        Results(tmp_path)


@pytest.mark.parametrize('cells', [
    {'frames': 'many'}, {'frames': 1e308}, {'frames': 10 ** 400}, {'frames': float('nan')},
    {'frames': [1]}, {'frames': {'a': 1}}, {'source': 5}, {'status': None}, {'set.a': [1]},
    {'remarks': 5}])
def test_a_row_with_other_cells_than_a_run_has_is_named(tmp_path, cells):
    (tmp_path / 'runs' / 'a' / 'b').mkdir(parents=True)
    file = tmp_path / 'runs' / 'a' / 'b' / 'row.json'
    content = {**row('bag'), 'run': 'runs/a/b', 'frames': 5, 'set.a': 'x', 'ate': None,
               'unused_sensors': 'it hangs', 'remarks': 'an image was skipped'}
    file.write_text(json.dumps(content))
    assert Results(tmp_path).rows
    file.write_text(json.dumps({**content, **cells}))
    with pytest.raises(InputError, match='row.json is not the row of a run: remove its folder'):
        Results(tmp_path)


def test_a_damaged_table_is_named(tmp_path):
    (tmp_path / 'table.parquet').write_bytes(b'no table')
    with pytest.raises(InputError, match='cannot read the table .*table.parquet'):
        read_table(tmp_path / 'table.parquet')


@pytest.mark.parametrize('source, variant, folder', [
    ('/data/mon/desk.mcap', 'a=1,b=x', 'runs/a=1,b=x/desk.mcap'),
    ('/data/desk/', 's', 'runs/s/desk'),
    ('s3://x/a b?c', '.hidden', 'runs/hidden/a_b_c'), ('/', '..', 'runs/_/recording'),
    (150 * 'n', 's', f'runs/s/{100 * "n"}')])
def test_a_run_is_in_a_folder_of_its_settings_and_recording(tmp_path, source, variant, folder):
    results, given = Results(tmp_path), row(source)
    results.add((source, variant), given)
    assert results.rows[source, variant]['run'] == folder
    content = json.loads((tmp_path / folder / 'row.json').read_text())
    assert content == {**given, 'run': folder} and 'run' not in given


def test_done_is_what_ended_well_of_whatever_content(tmp_path):
    results = Results(tmp_path)
    results.add(('1', 'a=1'), row('1'))
    results.add(('2', 'a=1'), row('2', status='failed'))
    keys = [(name, 'a=1') for name in '123']
    assert [results.is_done(key) for key in keys] == [True, False, False]
    assert [results.has(key, 'x') for key in keys] == [True, True, False]
    assert [each['source'] for each in results.write_table(keys)] == ['1', '2']


def test_nothing_of_an_earlier_run_is_left_in_its_folder(tmp_path):
    results = Results(tmp_path)
    results.add(('1', 'a=1'), row('1'), {'old.txt': b'', 'both.txt': b'old'})
    (tmp_path / 'runs/a=1/.1').mkdir()  # of a command that was killed
    (tmp_path / 'runs/a=1/.1/draft.txt').touch()
    results.add(('1', 'a=1'), row('1'), {'both.txt': b'new'})
    assert sorted(os.listdir(tmp_path / 'runs/a=1/1')) == ['both.txt', 'row.json']
    assert (tmp_path / 'runs/a=1/1/both.txt').read_text() == 'new'
    assert os.listdir(tmp_path / 'runs/a=1') == ['1']


def test_a_place_for_no_folder_is_named(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(InputError) as caught:
        Results(tmp_path / 'file')
    assert str(caught.value) == (f'--out {tmp_path}/file: cannot make the folder: File exists; '
                                 'name another folder')


def test_results_on_a_disk_that_cannot_be_written_are_rejected_before_the_runs(
        tmp_path, monkeypatch):
    """Whose folders are there, of an earlier fleet."""
    Results(tmp_path).add(('1', 'a=1'), row('1'))

    def fail(path, content):
        raise OSError(errno.EROFS, 'Read-only file system', str(path))
    monkeypatch.setattr(Path, 'write_bytes', fail)
    with pytest.raises(InputError) as caught:
        Results(tmp_path)
    assert str(caught.value) == (
        f'--out {tmp_path}: cannot write into the folder: Read-only file system; name '
        'another folder, or make room there')
