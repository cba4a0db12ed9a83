# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The figures on the terminal and as JSON."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from aick_ros.cli.commands import evaluate as evaluate_module
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.evaluation import evaluate as evaluate_source
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.settings.presets import preset
from aick_ros.sources import raise_damage
from aick_ros.sources.writers.bag_writer import write_bag

ROOT = Path(__file__).parents[3]


@pytest.fixture
def evaluate(aick, monkeypatch):
    """Return a function that evaluates a source in memory."""
    def run(source, *arguments):
        monkeypatch.setattr(evaluate_module, 'open_source', lambda path, options: source)
        return aick('evaluate', 'a source', *arguments)
    return run


def without_times(figures):
    """Return the figures that are the same in each run."""
    if not isinstance(figures, dict):
        return figures
    return {key: without_times(value) for key, value in figures.items()
            if key not in ('timing_ms', 'registration_ms')}


def test_figures_are_those_of_the_evaluation(evaluate, recording):
    outcome = evaluate(recording, '--preset', 'paper-fast', '--gaps', '2,1', '--json', '-')
    figures = json.loads(outcome.out)
    expected = json.loads(json.dumps(
        evaluate_source(recording, preset('paper-fast'), [1, 2]).to_json()))
    assert outcome.code == 0
    assert without_times({key: figures[key] for key in expected}) == without_times(expected)
    assert (figures['ended'], figures['damaged_images']) == ('complete', 0)


def test_standard_output_of_a_process_is_json_alone(recording, tmp_path):
    write_bag(tmp_path / 'bag', recording)
    process = subprocess.run(
        [sys.executable, '-m', 'aick_ros', 'evaluate', 'bag', '--gaps', '1,3', '--limit', '5',
         '--json', '-'], cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)},
        capture_output=True, text=True, check=False)
    assert process.returncode == 0
    figures = json.loads(process.stdout)
    assert figures['source'] == 'bag'
    assert figures['pairs']['3']['count'] == 2
    assert 'ATE' in process.stderr


def test_tables_and_file(evaluate, recording, tmp_path):
    outcome = evaluate(recording, '--gaps', '1', '--json', tmp_path / 'figures.json')
    figures = json.loads((tmp_path / 'figures.json').read_text())
    assert f'{figures["pairs"]["1"]["success_ratio"]["0.01"]:.3f}' in outcome.out
    assert f'{figures["trajectory"]["ate_rmse_m"]:.4f} m' in outcome.out
    assert list(tmp_path.iterdir()) == [tmp_path / 'figures.json']


@pytest.mark.parametrize('count, late, is_told', [(1, 0, False), (2, 0, False), (2, 10, True)])
def test_that_clocks_may_differ_is_told_where_frames_have_no_ground_truth(
        evaluate, in_memory, recording, count, late, is_told):
    """Of a single frame nobody expects an ATE."""
    frames = [dataclasses.replace(frame, stamp=frame.stamp + late * 10 ** 9)
              for _, frame in zip(range(count), recording.frames(raise_damage))]
    outcome = evaluate(in_memory(frames, recording.ground_truth), '--gaps', '1')
    assert outcome.code == 0
    assert ('check that both have the same clock' in outcome.err) is is_told


@pytest.mark.parametrize('command', ['evaluate', 'replay'])
@pytest.mark.parametrize('interval, sentence', [
    (0.1, 'poses of the ground truth of in memory are 0.1 s apart: errors and NEES include'),
    (0.5, 'poses of the ground truth of in memory are 0.5 s apart, and up to 0.15 s are')])
def test_a_sparse_ground_truth_is_used_and_named(
        aick, recording, in_memory, monkeypatch, command, interval, sentence):
    frames = [dataclasses.replace(frame, stamp=frame.stamp + 10 ** 7)
              for frame in recording.frames(raise_damage)]
    dense = recording.ground_truth
    stamps = np.arange(int(interval * 1e9), int(frames[-1].stamp), int(interval * 1e9))
    stamps = stamps[stamps > dense.stamps[0]]
    source = in_memory(frames, Trajectory(stamps, np.tile(np.eye(4), (len(stamps), 1, 1))))
    monkeypatch.setattr(f'aick_ros.cli.commands.{command}.open_source', lambda *_: source)
    outcome = aick(command, 'a source')
    assert (outcome.code, sentence in outcome.err, 'clock' in outcome.err) == (0, True, False)
    assert ('ATE ' in outcome.out) is (command == 'evaluate' or interval == 0.1)


@pytest.mark.parametrize('gaps, missing', [('1,3', ''), ('3,20,100', '20,100'), ('20', '20')])
def test_gaps_without_a_pair_are_named_and_have_no_row(evaluate, recording, gaps, missing):
    outcome = evaluate(recording, '--gaps', gaps, '--limit', '5')
    assert outcome.code == 0
    assert outcome.err == (
        f'aick: in memory (5 frames) has no pair at --gaps {missing}: name gaps below 5, or read '
        'more frames\n' if missing else '')
    firsts = [line.split()[0] for line in outcome.out.splitlines() if line.strip()]
    assert not {'20', '100'} & set(firsts) and 'gap 20' not in outcome.out
    assert ('3' in firsts) is ('3' in gaps)


def test_covariances_and_silent_failures_are_shown(evaluate, recording, tmp_path):
    outcome = evaluate(recording, '--gaps', '1,3', '--json', tmp_path / 'figures.json')
    figures = json.loads((tmp_path / 'figures.json').read_text())
    lines = outcome.out.splitlines()
    for name, score in (('odometry', figures['consistency']),
                        ('gap 3', figures['pairs']['3']['consistency'])):
        [line] = [line for line in lines if line.startswith(name)]
        assert line.split()[-3:] == [f'{score["nees_mean"]:.1f}', f'{score["inside_95"]:.3f}',
                                     f'{score["inside_997"]:.3f}']
    [line] = [line for line in lines if 'error above 5 cm or 3 deg' in line]
    assert line.endswith(f'{figures["silent_failures"]["reported_good_but_off"]} of '
                         f'{figures["silent_failures"]["reported_good"]}')


def test_consistency_along_the_trajectory_is_shown(evaluate, recording, tmp_path):
    outcome = evaluate(recording, '--gaps', '1', '--json', tmp_path / 'figures.json')
    figures = json.loads((tmp_path / 'figures.json').read_text())
    lines = [line.split() for line in outcome.out.splitlines()]
    for name, score in (('10 frames', figures['trajectory_consistency']['10']),
                        ('poses', figures['pose_consistency'])):
        cells = [f'{score[part][key]:.{digits}f}' for part in ('joint', 'translation', 'rotation')
                 for key, digits in (('nees_mean', 1), ('inside_95', 3))]
        assert [*name.split(), str(score['count']), *cells] in lines
    assert '100 frames' not in outcome.out
    assert 'at rest' not in outcome.out


def test_a_sensor_that_is_not_used_is_named_once(evaluate, recording, stuck, in_memory):
    outcome = evaluate(in_memory(stuck, recording.ground_truth), '--preset', 'paper-fast',
                       '--gaps', '1')
    assert outcome.code == 0
    (sentence,) = outcome.err.splitlines()
    assert sentence.startswith('aick: in memory: the accelerometer has reported (0, -9.8, 0.5) ')


def test_drift_at_rest_is_shown(evaluate, in_memory, recording):
    first = next(iter(recording.frames(raise_damage)))
    still = [dataclasses.replace(first, stamp=first.stamp + index * 400_000_000)
             for index in range(4)]
    stamps = np.array([frame.stamp for frame in still])
    truth = Trajectory(stamps, np.tile(np.eye(4), (4, 1, 1)))
    outcome = evaluate(in_memory(still, truth), '--gaps', '1')
    assert 'at rest for 1 s, largest drift' in outcome.out
    assert ' mm/min, ' in outcome.out


def test_the_trajectory_is_exported_with_its_covariances(evaluate, recording, tmp_path):
    outcome = evaluate(recording, '--gaps', '1', '--export', tmp_path / 'a' / 'b')
    assert outcome.code == 0
    rows = {path.stem: len([line for line in path.read_text().splitlines() if line[0] != '#'])
            for path in (tmp_path / 'a' / 'b').iterdir()}
    assert rows == {'estimate': len(recording) - 1, 'reference': len(recording)}
    (tmp_path / 'file').touch()
    outcome = evaluate(recording, '--export', tmp_path / 'file')
    assert outcome.code == 2
    assert f'--export {tmp_path / "file"}: cannot make the folder' in outcome.sentence


def test_plots_are_drawn_for_odometry_and_gaps(evaluate, recording, tmp_path):
    outcome = evaluate(recording, '--gaps', '1,3,100', '--plots', tmp_path / 'plots')
    assert outcome.code == 0
    plots = sorted((tmp_path / 'plots').iterdir())
    assert [plot.name for plot in plots] == [
        'nees_gap_1.png', 'nees_gap_3.png', 'nees_odometry.png']
    assert all(cv2.imread(str(plot)).shape[1] > 1000 for plot in plots)


def closed(*given, **named):
    """Print where nobody reads."""
    raise BrokenPipeError


def test_files_are_written_where_nobody_reads_the_figures(
        evaluate, recording, tmp_path, monkeypatch):
    monkeypatch.setattr(evaluate_module, 'show', closed)
    names = {'plots/nees_odometry.png', 'export/estimate.SQUARE', 'export/reference.SQUARE'}
    files = ('--limit', '4', '--gaps', '1', '--plots', 'plots', '--export', 'export')
    assert evaluate(recording, *files, '--json', 'figures.json').code == 141
    assert all((tmp_path / name).is_file() for name in {*names, 'figures.json'})
    monkeypatch.setattr(evaluate_module, 'write_json', closed)
    shutil.rmtree(tmp_path / 'plots')
    shutil.rmtree(tmp_path / 'export')
    assert evaluate(recording, *files, '--json', '-').code == 141
    assert all((tmp_path / name).is_file() for name in names)


def test_figures_are_shown_where_plots_cannot_be_written(
        evaluate, recording, tmp_path, monkeypatch):
    def fail(folder, evaluation):
        raise InputError('the disk is full')
    monkeypatch.setattr(evaluate_module, 'write_plots', fail)
    outcome = evaluate(recording, '--limit', '4', '--plots', 'p', '--json', 'figures.json')
    assert (outcome.code, outcome.err.splitlines()[-1]) == (2, 'aick: the disk is full')
    assert 'ATE' in outcome.out and (tmp_path / 'figures.json').is_file()


def test_plots_are_checked_before_the_run(evaluate, recording, tmp_path, monkeypatch):
    (tmp_path / 'file').touch()
    for target in (tmp_path / 'file', tmp_path / 'file' / 'plots'):
        outcome = evaluate(recording, '--plots', target)
        assert outcome.code == 2
        assert f'--plots {target}: cannot make the folder' in outcome.sentence
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    assert "pip install '.[eval]'" in evaluate(recording, '--plots', 'p').sentence
    assert list(tmp_path.iterdir()) == [tmp_path / 'file']


def test_without_ground_truth_nothing_is_plotted(evaluate, recording, in_memory, tmp_path):
    outcome = evaluate(in_memory(list(recording.frames(raise_damage))[:3]), '--plots', 'plots')
    assert outcome.code == 0
    assert 'no plots' in outcome.err
    assert 'error above' not in outcome.out
    assert list(tmp_path.iterdir()) == []


def test_missing_ground_truth_is_reported(evaluate, recording, in_memory):
    outcome = evaluate(in_memory(list(recording.frames(raise_damage))[:3]), '--json', '-')
    assert outcome.code == 0
    assert outcome.err.startswith('aick: in memory has no ground truth')
    assert 'no pair' not in outcome.err
    figures = json.loads(outcome.out)
    assert figures['pairs']['10']['count'] == 0
    assert figures['trajectory']['ate_rmse_m'] is None


def test_an_interrupted_run_has_results(evaluate, recording, in_memory):
    def interrupt(index, on_damaged):
        if index == 3:
            signal.raise_signal(signal.SIGINT)

    source = in_memory(list(recording.frames(raise_damage)), recording.ground_truth, interrupt)
    outcome = evaluate(source, '--gaps', '1', '--json', '-')
    figures = json.loads(outcome.out)
    assert outcome.code == 130
    assert figures['ended'] == 'interrupted'
    assert 1 <= figures['frames'] < len(recording)
    assert 'aick: interrupted' in outcome.err


def test_damaged_images_and_a_broken_end_are_reported(evaluate, recording, in_memory):
    def broken(index, on_damaged):
        on_damaged(InputError(f'torn before {index}'))
        if index == 4:
            raise InputError('the index is broken')

    source = in_memory(list(recording.frames(raise_damage)), recording.ground_truth, broken)
    outcome = evaluate(source, '--gaps', '1', '--json', '-')
    figures = json.loads(outcome.out)
    assert outcome.code == 2
    assert (figures['frames'], figures['damaged_images']) == (4, 5)
    assert figures['ended'] == 'the index is broken'
    assert outcome.err.splitlines()[-1] == 'aick: the index is broken'
