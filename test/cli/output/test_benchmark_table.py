# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of a benchmark by scores made by hand."""

from types import SimpleNamespace

import pytest

from aick_ros.cli.output import benchmark_table
from aick_ros.cli.output.benchmark_table import show_results


def score(failures=()):
    """Return the score of a method: 40 pairs at gap 1 and 30 at gap 5."""
    pairs = {gap: SimpleNamespace(
        count=count, failed=count // 10, registration_ms=SimpleNamespace(p50=1.234, p99=9.876),
        success_ratio={'0.0033': 0.25, '0.01': 0.5, '0.05': 0.75})
        for gap, count in (('1', 40), ('5', 30))}
    return SimpleNamespace(pairs=pairs, preparation_ms=SimpleNamespace(p50=12.34),
                           failures=dict(failures))


@pytest.fixture
def results():
    return SimpleNamespace(
        recordings={'a room': {'frames': 123, 'pairs': {'1': 40, '5': 30}}},
        methods={'aick': {'a room': score({'too few matches': 4})},
                 'ndt': {'a room': score({'crashed (Aborted)': 7, 'took longer than 2 s': 1})}},
        not_run={'gicp': 'pcl is missing'})


def test_rows_and_sentences(capsys, results):
    show_results(results, on_stderr=False)
    shown = capsys.readouterr()
    assert shown.out.splitlines()[0].strip() == 'a room: 123 frames'
    rows = [line.replace('│', ' ').split() for line in shown.out.splitlines() if '1.23' in line]
    numbers = ['0.25', '0.50', '0.75', '1.23', '9.88']
    assert [[float(cell) if '.' in cell else cell for cell in row] for row in rows] == [
        [float(cell) if '.' in cell else cell for cell in row] for row in (
            ['aick', '1', '40', '4', *numbers, '12.3'], ['5', '30', '3', *numbers],
            ['ndt', '1', '40', '4', *numbers, '12.3'], ['5', '30', '3', *numbers])]
    assert shown.err.splitlines() == [
        'aick: ndt on a room: 7 pairs failed: crashed (Aborted)',
        'aick: ndt on a room: 1 pair failed: took longer than 2 s',
        'aick: gicp was not run: pcl is missing']


def test_gaps_without_a_pair_are_named_and_have_no_row(capsys, results):
    """The first gap that has a row has the name of the method, too."""
    results.recordings['a room']['pairs'] = {'1': 0, '5': 30, '200': 0}
    show_results(results, on_stderr=False)
    shown = capsys.readouterr()
    rows = [line.split()[:3] for line in shown.out.splitlines() if '1.23' in line]
    assert rows == [['aick', '5', '30'], ['ndt', '5', '30']]
    assert shown.err.splitlines()[0] == (
        'aick: a room (123 frames) has no pair at --gaps 1,200: name others; a pair counts where '
        'the ground truth covers both of its frames and none is missing between them')


def test_heads_name_what_is_in_a_column_and_its_unit(monkeypatch, results):
    shown = []
    monkeypatch.setattr(benchmark_table, 'table', lambda *given: shown.append(
        (*given[:1], *map(list, given[1:3]), given[3])))
    show_results(results, on_stderr=True)
    (title, rows, columns, on_stderr), = shown
    assert (title, on_stderr) == ('a room: 123 frames', True)
    heads = [column.replace('\n', ' ') for column in columns]
    assert dict(zip(heads, rows[0], strict=True)) == {
        'method': 'aick', 'gap': '1', 'pairs': '40', 'failed': '4', 'within 3.3 mm': '0.250',
        '10 mm': '0.500', '50 mm': '0.750', 'p50 [ms]': '1.23', 'p99 [ms]': '9.88',
        'per frame [ms]': '12.3'}
    assert (rows[1][0], rows[1][-1]) == ('', '')


def test_with_json_on_standard_output_the_table_is_on_the_other(capsys, results):
    show_results(results, on_stderr=True)
    assert capsys.readouterr().out == ''
