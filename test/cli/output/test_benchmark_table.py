# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of a benchmark by scores made by hand."""

from types import SimpleNamespace

from aick_ros.cli.output.benchmark_table import show_results


def score(failures=()):
    """Return the score of a method: 40 pairs at gap 1 and 30 at gap 5."""
    pairs = {gap: SimpleNamespace(
        count=count, failed=count // 10, registration_ms=SimpleNamespace(p50=1.234, p99=9.876),
        success_ratio={'0.0033': 0.25, '0.01': 0.5, '0.05': 0.75})
        for gap, count in (('1', 40), ('5', 30))}
    return SimpleNamespace(pairs=pairs, preparation_ms=SimpleNamespace(p50=12.34),
                           failures=dict(failures))


def test_rows_and_sentences(capsys):
    results = SimpleNamespace(
        recordings={'a room': {'frames': 123, 'pairs': {'1': 40, '5': 30}}},
        methods={'aick': {'a room': score({'too few matches': 4})},
                 'ndt': {'a room': score({'crashed (Aborted)': 7, 'took longer than 2 s': 1})}},
        not_run={'gicp': 'pcl is missing'})
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
        'aick: ndt on a room: 1 pairs failed: took longer than 2 s',
        'aick: gicp was not run: pcl is missing']
