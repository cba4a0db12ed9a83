# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Output streams that are closed or lead to a full disk end no program, and change no code."""

import os
import subprocess
import sys

import pytest

PROGRAM = '''
import os, sys
from aick_ros.borders.streams import flush_output, open_streams, say
open_streams()
print(min(os.dup(0), 3))
say('program', 'one\\n\\x1b line')
flush_output()
sys.exit(2)
'''


def outcome(redirection):
    """Run the program with streams as a shell redirects them."""
    return subprocess.run(['sh', '-c', f'exec "$@" {redirection}', 'sh', sys.executable, '-c',
                           PROGRAM], capture_output=True, text=True, timeout=60,
                          env={**os.environ, 'PYTHONUNBUFFERED': ''})


def test_a_sentence_is_one_printable_line():
    done = outcome('')
    assert (done.returncode, done.stdout, done.stderr) == (2, '3\n', 'program: one \\x1b line\n')


@pytest.mark.parametrize('redirection, stderr', [
    ('>&-', 'program: one \\x1b line\n'), ('2>&-', ''), ('>&- 2>&- <&-', ''),
    ('>/dev/full', 'program: one \\x1b line\n'), ('2>/dev/full', ''),
    ('>/dev/full 2>/dev/full', '')])
def test_where_it_cannot_be_written_the_code_stays(redirection, stderr):
    done = outcome(redirection)
    assert (done.returncode, done.stderr) == (2, stderr)
