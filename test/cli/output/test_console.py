# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Where nobody reads what is printed, the results are not lost; tables of any width."""

import io
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from aick_ros.cli.output import console
from aick_ros.cli.output.console import decimal, line, progress, say, table

PROGRAM = """
import os
from aick_ros.borders.streams import flush_output
from aick_ros.cli.output.console import line, say, table
try:
    for on_stderr in ({stderr}, {stderr}):  # the second time the pipe is known to be closed
        table('title', [('name', 'value')], on_stderr=on_stderr)
        line('a line', on_stderr)
    say('a sentence')
    print('all of it', flush=True)
    flush_output()  # as the command does at its end
except BrokenPipeError:
    os._exit(7)
"""


def run(stderr):
    """Print on a stream whose reader has gone."""
    reader, writer = os.pipe()
    os.close(reader)
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE,
               'stderr' if stderr else 'stdout': writer}
    try:
        return subprocess.run([sys.executable, '-c', PROGRAM.format(stderr=stderr)], **streams)
    finally:
        os.close(writer)


def test_a_closed_standard_error_changes_nothing():
    done = run(stderr=True)
    assert (done.returncode, done.stdout) == (0, b'all of it\n')


def test_a_closed_standard_output_is_left_to_the_caller():
    assert run(stderr=False).returncode == 7


@pytest.mark.parametrize('name', ['open3d-hybrid-and-more', 'n' * 60])
def test_a_narrow_table_has_whole_names(capsys, monkeypatch, name):
    monkeypatch.setenv('COLUMNS', '60')
    table('times', [[name, *8 * ['12.345']]], ['method', *8 * ['column']])
    printed = capsys.readouterr().out
    assert name[:24] in printed
    assert all(len(line) <= 24 + 8 * (2 + 6) for line in printed.splitlines())
    assert printed.count('12.345') == printed.count('column') == 8
    assert printed.count('n') >= name.count('n')


@pytest.mark.parametrize('width', ['40', '80'])
def test_a_narrow_table_has_whole_words_in_its_last_column(capsys, monkeypatch, width):
    monkeypatch.setenv('COLUMNS', width)
    table('runs/first against runs/second',
          [['RPE over 1 s, translation', '12.345', '12.345', '+10.0 %', '-12.0 to 12.0 %', verdict]
           for verdict in ('worse', 'within chance', 'not tested')],
          ['', 'baseline', 'candidate', 'change', '95% interval', ''])
    printed = capsys.readouterr().out
    assert [printed.count(word) for word in ('worse', 'within', 'chance', 'tested')] == 4 * [1]


@pytest.mark.parametrize('width', ['20', '40'])
def test_a_narrow_table_has_whole_numbers_and_heads(capsys, monkeypatch, width):
    monkeypatch.setenv('COLUMNS', width)
    cells = ('0.01063 m', '0.02341 m', '+120.3 %', '-1.2 % to +230.0 %', 'within chance')
    heads = ('', 'baseline', 'candidate', 'change', '99% interval', '')
    table('runs', [['RPE over 1 s, translation', *cells]], heads)
    words = capsys.readouterr().out.split()
    assert {word for text in (*cells, *heads) for word in text.split()} <= set(words)


def test_a_path_is_folded_where_it_is_wider_than_the_terminal(capsys, monkeypatch):
    """It would make each line of the table longer than the terminal is wide."""
    monkeypatch.setenv('COLUMNS', '60')
    table('desk', [['frames', '30'], ['files', '/' + 'a/' * 50]])
    assert all(len(row) <= 60 for row in capsys.readouterr().out.splitlines())


@pytest.mark.parametrize('variable', ['FORCE_COLOR', 'TTY_COMPATIBLE'])
def test_a_bar_moves_no_cursor_in_a_file(variable):
    program = ('from aick_ros.cli.output.console import progress, say\n'
               'with progress("reading", 2) as show:\n show(1)\n say("a sentence")')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          env={**os.environ, variable: '1'}, check=True)
    assert done.stderr == 'aick: a sentence\n'


@pytest.mark.parametrize('given, text', [
    ((None,), '-'), ((None, ' ms', 1), '-'), ((1.23456,), '1.235'), ((0.0,), '0.000'),
    ((2.55, ' mm'), '2.550 mm'), ((-12.34, ' deg', 1), '-12.3 deg'), ((7.6, '', 0), '8')])
def test_numbers_have_decimals_and_a_unit_and_none_is_a_dash(given, text):
    assert decimal(*given) == text


def test_a_sentence_is_one_line_after_the_name_of_the_command(capsys):
    say('first\nsecond [bold]x[/bold] :smile: ' + 50 * 'long ')
    out, err = capsys.readouterr()
    assert (out, err.count('\n')) == ('', 1)
    assert err.startswith('aick: first') and '[bold]x[/bold] :smile: long long' in err


@pytest.mark.parametrize('on_stderr', [False, True])
def test_tables_and_lines_are_on_the_stream_that_is_asked_for(capsys, on_stderr):
    table('numbers', [['a', '1.5'], ['longer', '22.5']], ['name', 'value'], on_stderr)
    line('and a line', on_stderr)
    shown, other = capsys.readouterr()[::-1 if on_stderr else 1]
    assert other == ''
    rows = [row.rstrip() for row in shown.splitlines()]
    assert [row.split() for row in rows] == [['numbers'], ['name', 'value'], ['a', '1.5'],
                                             ['longer', '22.5'], ['and', 'a', 'line']]
    # the first column is flush at the left, the other at the right
    assert rows[2][0] == 'a' and len(rows[2]) == len(rows[3]) == len(rows[1])


def test_without_heads_a_table_has_none(capsys):
    table('', [('a', '1'), ('b', '2')])
    assert [row.split() for row in capsys.readouterr().out.splitlines()][-2:] == [
        ['a', '1'], ['b', '2']]
    table('a', [('first', '1')])
    assert [row.split() for row in capsys.readouterr().out.splitlines()] == [['a'], ['first', '1']]
    table('none', [], ['name', 'value'])
    assert 'name' in capsys.readouterr().out


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize('pause, expected', [(0.5, ['8/20', '16 pairs/s']),
                                             (0.19, ['0/20', '0 pairs/s'])])
def test_a_bar_has_the_number_and_the_rate_a_few_times_a_second(monkeypatch, pause, expected):
    screen = Terminal()
    monkeypatch.setattr(console, '_ERRORS', console._Console(
        file=screen, force_terminal=True, width=100, color_system=None))
    times = iter([100.0, 100.0 + pause, 100.0 + pause])
    monkeypatch.setattr(console, 'time', SimpleNamespace(monotonic=lambda: next(times)))
    with progress('registering', 20, 'pairs') as show:
        show(8)
        show(9)  # too soon after the first
    last = screen.getvalue().rpartition('registering')[2]
    assert [word for word in expected if f' {word}' not in last] == []
    assert '\x1b[2K' in last  # at the end the line is cleared


@pytest.mark.parametrize('error', [BrokenPipeError, OSError])
def test_a_line_that_nobody_reads_ends_the_command_on_standard_output_alone(monkeypatch, error):
    def fail(text, err):
        raise error
    monkeypatch.setattr(console.typer, 'echo', fail)
    line('a line', on_stderr=True)
    with pytest.raises(error):
        line('a line')
