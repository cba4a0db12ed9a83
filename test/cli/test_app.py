# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What holds for all commands."""

import pytest

RECORDING = 'recording/rgb.txt'


@pytest.mark.parametrize('arguments, name', [
    *((f'{command} recording --json', RECORDING)
      for command in ('replay', 'evaluate', 'noise', 'benchmark', 'demo')),
    ('benchmark other recording --json', RECORDING),
    ('vocabulary recording --out', RECORDING),
    *((f'{command} recording {option} other.yaml --json', 'other.yaml')
      for command in ('replay', 'evaluate', 'noise') for option in ('--camera', '--config')),
    ('vocabulary recording --config other.yaml --out', 'other.yaml'),
    ('evaluate recording --set aick.vocabulary=other.yaml --json', 'other.yaml'),
    ('compare run run --out', 'run/summary.json'),
    ('compare run run --json', 'run/summary.json')])
def test_results_replace_no_input(aick, tmp_path, arguments, name):
    for file in (RECORDING, 'run/summary.json'):
        (tmp_path / file).parent.mkdir()
        (tmp_path / file).write_text('input')
    (tmp_path / 'other.yaml').write_text('/**:\n  ros__parameters:\n    aick.alpha: 0.7\n')
    before = (tmp_path / name).read_text()
    outcome = aick(*arguments.split(), name)
    assert outcome.code == 2
    assert outcome.sentence.startswith(f'cannot write {name}: it is a')
    assert 'input' in outcome.sentence
    assert (tmp_path / name).read_text() == before


def test_two_results_have_two_files(aick, tmp_path):
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run' / 'summary.json').write_text('')
    outcome = aick('compare', 'run', 'run', '--out', 'page', '--json', './page')
    assert outcome.code == 2
    assert outcome.sentence == '--json and --out are both page: name two files'
