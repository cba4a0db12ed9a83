# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Damaged inputs end in InputError: a few of them, and the inputs that failed once."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parents[1] / 'tools' / 'fuzz'
SEEDS = FUZZ / 'seeds'
CASES = 30


@pytest.fixture
def minimise(monkeypatch):
    monkeypatch.syspath_prepend(FUZZ)
    return __import__('minimise').minimise


@pytest.fixture(scope='module', autouse=True)
def minute(tmp_path_factory):
    """Fuzz for a minute, with another seed each time, while the tests of this file run."""
    findings = tmp_path_factory.mktemp('findings')
    with subprocess.Popen(['nice', sys.executable, FUZZ, '--seconds', '60', '--keep', findings],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        yield process, findings
        process.terminate()


def fuzz(*arguments):
    return subprocess.run([sys.executable, FUZZ, *map(str, arguments)], capture_output=True,
                          text=True)


def test_nothing_but_input_errors(tmp_path):
    run = fuzz('--cases', CASES, '--seed', '1', '--keep', tmp_path)
    assert run.returncode == 0, run.stdout + ''.join(
        path.read_text() for path in tmp_path.rglob('*.txt')) + run.stderr
    counts = {line.split()[0]: int(line.split()[1]) for line in run.stdout.splitlines()[:-1]}
    assert set(counts) >= {path.name for path in SEEDS.iterdir()} - {'node'}
    assert set(counts.values()) == {CASES}


def test_what_fails_is_kept_and_small(tmp_path):
    statements = {
        'data[0]': 'IndexError', 'bytearray(2 ** 31)': 'MemoryError', 'os.abort()': 'killed',
        'print("noise", file=sys.stderr, flush=True)': 'printed', 'None': '',
        'warnings.warn("odd")': 'UserWarning', 'raise InputError("damaged")': ''}
    code = f"""
import os, sys, warnings
from pathlib import Path
sys.path.insert(0, {str(FUZZ)!r})
import campaign
from aick_ros.errors import InputError
def target(data, folder):
    if data.find(b'\\x08') >= 0:
        data = b''
        exec(statement)
for number, statement in enumerate({list(statements)}):
    part = campaign.run_slice('rvl', target, '0', 60.0, 3)
    campaign.keep([part], Path({str(tmp_path)!r}) / str(number))
"""
    temporary = tmp_path / 'temporary'
    temporary.mkdir()
    subprocess.run([sys.executable, '-c', code], check=True,
                   env={**os.environ, 'TMPDIR': str(temporary)})
    assert not list(temporary.iterdir())
    for number, finding in enumerate(statements.values()):
        kept = [path for path in (tmp_path / str(number)).rglob('*')
                if path.is_file() and path.suffix != '.txt']
        assert [path.name.split('-')[0] for path in kept] == ([finding] if finding else [])
        assert all(path.read_bytes() == b'\x08' for path in kept)


def test_minimising_leaves_what_is_needed(minimise):
    def fails(data):
        return b'ab' in data and b'x' in data

    small = minimise(b'1234ab567890x' * 20, fails)
    assert fails(small) and len(small) == 3


def test_what_never_answers_is_found():
    code = f"""
import sys, time
sys.path.insert(0, {str(FUZZ)!r})
import campaign
campaign._SILENCE, campaign._LONGEST_SILENCE = 0.2, 0.6
def works(data, folder):
    while True:
        pass
for target in works, lambda data, folder: time.sleep(1000):
    print(*campaign.run_slice('rvl', target, '0', 60.0, 3).findings)
"""
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ['endless', 'endless']


def test_a_minute_of_damage_at_random(minute):
    process, findings = minute
    printed, _ = process.communicate()
    texts = [path.read_text() for path in findings.rglob('*.txt')]
    assert process.returncode == 0, '\n'.join([printed, *texts])
    assert re.search(r'\d+ inputs in \d+ s, seed \w{8}\n', printed)
    counts = {line.split()[0]: int(line.split()[1]) for line in printed.splitlines()[:-1]}
    assert set(counts) >= {path.name for path in SEEDS.iterdir()} - {'node'}
