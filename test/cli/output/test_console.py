# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Where nobody reads what is printed, the results are not lost; tables of any width."""

import os
import subprocess
import sys

import pytest

from aick_ros.cli.output.console import table

PROGRAM = """
import os
from aick_ros.cli.output.console import line, say, table
try:
    for on_stderr in ({stderr}, {stderr}):  # the second time the pipe is known to be closed
        table('title', [('name', 'value')], on_stderr=on_stderr)
        line('a line', on_stderr)
    say('a sentence')
    print('all of it', flush=True)
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
    assert all(len(line) <= 60 for line in printed.splitlines())
    assert printed.count('n') >= name.count('n')


@pytest.mark.parametrize('variable', ['FORCE_COLOR', 'TTY_COMPATIBLE'])
def test_a_bar_moves_no_cursor_in_a_file(variable):
    program = ('from aick_ros.cli.output.console import progress, say\n'
               'with progress("reading", 2) as show:\n show(1)\n say("a sentence")')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          env={**os.environ, variable: '1'}, check=True)
    assert done.stderr == 'aick: a sentence\n'
