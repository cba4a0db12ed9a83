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


def test_a_candidate_that_ended_early_fails(aick, replay, recording, tmp_path):
    """The baseline may be the shorter one: a sentence says so, but nothing fails."""
    frames = len(recording)
    replay('a')
    replay('b', '--limit', '9')
    early = aick('compare', 'a', 'b', '--fail-on-regression', '--json', 'early.json')
    assert early.code == 3
    said = f'b lacks frames that a has, {frames - 9} of {frames} of '
    assert f'aick: {said}' in early.err and said.replace(
        'b lacks', 'The candidate lacks').replace('a has', 'the baseline has') in (
            tmp_path / 'comparison.html').read_text()
    assert 'aick: worse than a: frames that b lacks\n' in early.err
    [found] = json.loads((tmp_path / 'early.json').read_text())['candidates'].values()
    assert (list(found['frames'].values()), found['is_incomplete'], found['regressions']) == (
        [{'baseline': frames, 'candidate': 9, 'common': 9}], True, [])
    assert aick('compare', 'a', 'b').code == 0
    late = aick('compare', 'b', 'a', '--fail-on-regression')
    assert (late.code, said in late.err) == (0, True)
    assert ' lacks ' not in aick('compare', 'b', 'b', '--fail-on-regression').err


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


def test_heads_names_and_page_are_beside_a_json_that_stands_alone(aick, replay, tmp_path):
    replay('a', '--limit', '3')
    shutil.copytree(tmp_path / 'a', tmp_path / 'b')
    outcome = aick('compare', 'a', 'b', 'a/latest', '--json', '-', '--out', 'page.html')
    content = json.loads(outcome.out)
    assert (content['baseline'], list(content['candidates'])) == ('a', ['b', 'a/latest'])
    lines = [line.split() for line in outcome.err.splitlines() if not line.startswith('aick: ')]
    assert lines[0] == ['b', 'against', 'a']
    assert lines[1] == ['baseline', 'candidate', 'change', '99%', 'interval']
    assert outcome.err.endswith('\naick: details: page.html\n')


def test_of_several_runs_of_a_recording_the_last_counts(aick, replay, tmp_path):
    replay('a', '--limit', '3')
    shutil.copytree(tmp_path / 'a', tmp_path / 'b')
    first = (tmp_path / 'a' / 'latest').resolve()
    shutil.copytree(first, first.with_name('0-earlier'))
    summary = json.loads((first / 'summary.json').read_text())
    (first / 'summary.json').write_text(json.dumps({**summary, 'peak_memory_mb': 77.0}))
    outcome = aick('compare', 'a', 'b', '--json', '-')
    assert 'aick: a has several runs of a recording: the last by name is compared' in outcome.err
    [candidate] = json.loads(outcome.out)['candidates'].values()
    assert candidate['total']['peak_memory_mb']['baseline'] == 77.0


def test_page_and_json_are_two_files(aick, replay):
    replay('a', '--limit', '3')
    outcome = aick('compare', 'a', 'a', '--json', 'x', '--out', './x')
    assert (outcome.code, outcome.sentence) == (2, '--json and --out are both x: name two files')


def test_the_page_is_a_file(aick, tmp_path):
    outcome = aick('compare', 'a', 'b', '--out', '-')
    assert (outcome.code, outcome.sentence) == (
        2, 'the page cannot go to standard output: give --out a file; --json - is for other '
        'programs')
    assert list(tmp_path.iterdir()) == []


def test_no_file_of_a_run_is_replaced(aick, replay):
    replay('a', '--limit', '3')
    for option in ('--json', '--out'):
        outcome = aick('compare', 'a', 'a', option, 'a/latest/frames.csv')
        assert outcome.code == 2 and 'is a file of the input' in outcome.sentence
