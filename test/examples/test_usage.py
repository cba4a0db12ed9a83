# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An example that is run without a recording, or with a wrong one, says what to do."""

import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

EXAMPLES = sorted((Path(__file__).parents[2] / 'examples').glob('*.py'))


@pytest.mark.parametrize('example', EXAMPLES, ids=lambda path: path.stem)
def test_without_arguments_the_usage_is_printed(example):
    ended = subprocess.run([sys.executable, str(example)], capture_output=True, text=True)
    assert ended.returncode == 1
    assert f'usage: {example.name} ' in ended.stderr
    assert 'Traceback' not in ended.stderr


@pytest.fixture
def end(monkeypatch, capfd):
    """Return a function that runs an example here and returns the text it exits with."""
    def run(*arguments):
        monkeypatch.setattr(sys, 'argv', [*map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(sys.argv[0], run_name='__main__')
        assert capfd.readouterr() == ('', '')
        assert isinstance(ended.value.code, str)  # which Python prints, and exits with 1
        return ended.value.code
    return run


@pytest.fixture
def sentence(end):
    """Return a function that returns this text where it is one line."""
    def run(*arguments):
        [line] = end(*arguments).splitlines()
        return line
    return run


@pytest.mark.parametrize('example', EXAMPLES, ids=lambda path: path.stem)
def test_a_recording_that_is_missing_is_named_in_one_sentence(sentence, example, tmp_path):
    line = sentence(example, tmp_path / 'none')
    assert str(tmp_path / 'none') in line
    assert 'does not exist' in line or 'No such file' in line


def test_a_recording_that_is_too_short_for_the_gap_is_named(sentence, tmp_path):
    write_tum(tmp_path / 'room', SyntheticSource(SyntheticOptions.perfect(seed=5, frames=2)))
    line = sentence(EXAMPLES[0].with_name('register_two_frames.py'), tmp_path / 'room', 9)
    assert line == f'{tmp_path}/room has no frame 9 after its first: give a smaller GAP'


@pytest.mark.parametrize('gap', ['five', '0', '-1', '1.5', ''])
def test_a_gap_that_is_no_whole_number_of_frames_prints_the_usage(end, gap):
    usage = end(EXAMPLES[0].with_name('register_two_frames.py'), 'synthetic:1', gap)
    assert 'GAP: a whole number of frames from 1 on' in usage


@pytest.mark.parametrize('content', [b'', b'text', b'PK\x03\x04', b'\x93NUMPY'])
def test_a_file_that_is_no_archive_of_arrays_is_named(sentence, tmp_path, content):
    (tmp_path / 'own.npz').write_bytes(content)
    line = sentence(EXAMPLES[0].with_name('custom_source.py'), tmp_path / 'own.npz')
    assert line == (f'{tmp_path}/own.npz: it is not an .npz file, which numpy.savez writes, or is '
                    'truncated')


def test_an_array_that_is_missing_is_named(sentence, tmp_path):
    np.savez(tmp_path / 'own.npz', k=np.eye(3))
    line = sentence(EXAMPLES[0].with_name('custom_source.py'), tmp_path / 'own.npz')
    assert line.startswith(f'{tmp_path}/own.npz: ')
    assert 'depth' in line
