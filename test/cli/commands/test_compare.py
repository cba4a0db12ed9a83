# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick compare`` on runs that ``aick replay`` wrote."""

import json
import shutil

import pytest

from aick_ros.cli.commands import replay as replay_module


@pytest.fixture
def replay(aick, monkeypatch, recording):
    """Return a function that replays the recording into a folder."""
    monkeypatch.setattr(replay_module, 'open_source', lambda path, options: recording)

    def run(out, *arguments):
        assert aick('replay', 'a source', '--preset', 'paper-fast', '--out', out,
                    *arguments).code == 0
    return run


def test_worse_settings_fail_and_the_same_do_not(aick, replay, tmp_path):
    replay('a')
    replay('b')
    replay('c', '--set', 'features.max_keypoints=40')
    same = aick('compare', 'a', 'b', '--fail-on-regression', '--json', 'same.json')
    assert same.code == 0
    assert 'ATE' in same.out
    [comparison] = json.loads((tmp_path / 'same.json').read_text())['candidates'].values()
    assert comparison['regressions'] == []
    assert comparison['total']['ate_m']['change'] == 0
    worse = aick('compare', 'a', 'b', 'c', '--fail-on-regression', '--out', 'page.html')
    assert worse.code == 3
    assert 'worse than a: ' in worse.err
    assert ' of b' not in worse.err
    page = (tmp_path / 'page.html').read_text()
    assert 'features.max_keypoints' in page
    assert aick('compare', 'a', 'c').code == 0


def test_what_is_no_run_is_named(aick, replay, tmp_path):
    replay('a', '--limit', '3')
    assert aick('compare', 'a').sentence == 'at least two runs are required, the baseline first'
    assert 'nothing is not a folder' in aick('compare', 'a', 'nothing').sentence
    (tmp_path / 'empty').mkdir()
    assert 'empty has no summary.json' in aick('compare', 'a', 'empty').sentence
    run = tmp_path / 'a' / 'latest'
    for damage, sentence in [('', 'is not JSON'), ('[]', 'is not the summary of a run'),
                             ('{"source": 1}', 'is not the summary of a run')]:
        shutil.copytree(run, tmp_path / 'b', dirs_exist_ok=True)
        (tmp_path / 'b' / 'summary.json').write_text(damage)
        outcome = aick('compare', 'a', 'b')
        assert (outcome.code, sentence in outcome.sentence) == (2, True)


def test_runs_without_a_recording_in_common(aick, replay, tmp_path):
    replay('a', '--limit', '3')
    other = tmp_path / 'b'
    shutil.copytree(tmp_path / 'a' / 'latest', other)
    summary = json.loads((other / 'summary.json').read_text())
    (other / 'summary.json').write_text(json.dumps({**summary, 'source': 'another'}))
    assert 'no recording in common' in aick('compare', 'a', 'b').sentence
