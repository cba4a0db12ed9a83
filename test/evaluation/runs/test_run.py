# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which folders a path stands for, in folders and tables made by hand."""

import csv
import json

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.runs.frames_csv import cells, columns
from aick_ros.evaluation.runs.run import read_run, run_folders
from aick_ros.evaluation.runs.table import DONE, FAILED, TABLE, read_table, table_bytes
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory, trajectory_text
from aick_ros.registration.status import Status

SUMMARY = {'source': 'a room', 'settings': {}, 'machine': {}}


@pytest.fixture
def runs(tmp_path):
    """Return a folder with two runs that have ended, one that has not, and a link to the last."""
    for name in ('20', '10', '30'):
        (tmp_path / name).mkdir()
    for name in ('20', '10'):
        (tmp_path / name / files.SUMMARY).write_text(json.dumps(SUMMARY))
    (tmp_path / 'latest').symlink_to('20', target_is_directory=True)
    return tmp_path


def test_a_folder_stands_for_the_runs_in_it_that_have_ended_each_once(runs):
    assert run_folders(runs) == [runs / '10', runs / '20']


@pytest.mark.parametrize('name', ['10', 'latest'])
def test_a_run_stands_for_itself_by_a_link_too(runs, name):
    assert run_folders(runs / name) == [runs / name]


@pytest.mark.parametrize('name, sentence', [
    ('30', '30 has no summary.json, nor has a folder in it'), ('40', '40 is not a folder')])
def test_where_there_is_no_run_the_path_is_named(runs, name, sentence):
    with pytest.raises(InputError, match=sentence):
        run_folders(runs / name)


@pytest.mark.parametrize('name, others, is_demo', [
    ('demo-desk', [files.TRAJECTORY], True), ('desk', [files.TRAJECTORY], False),
    ('demo-desk', [files.TRAJECTORY, files.FRAMES], False), ('demo-desk', [], False)])
def test_a_demo_is_told_from_a_run_that_has_not_ended(tmp_path, name, others, is_demo):
    (tmp_path / name).mkdir()
    for other in others:
        (tmp_path / name / other).touch()
    (tmp_path / 'latest').symlink_to(name, target_is_directory=True)
    with pytest.raises(InputError, match='latest is the folder of a demo' if is_demo
                       else f'latest has no {files.SUMMARY}'):
        run_folders(tmp_path / 'latest')


def write_table(folder, *rows):
    """Write the table of runs: their status, variant and folder."""
    pytest.importorskip('pyarrow')
    (folder / TABLE).write_bytes(table_bytes(
        [dict(zip(('status', 'variant', 'run'), row)) for row in rows]))


@pytest.mark.parametrize('end', ['', TABLE])
def test_a_table_stands_for_its_runs_that_were_done(runs, end):
    write_table(runs, (DONE, 'a', 'runs/a/1'), (FAILED, 'b', 'runs/b/2'), (DONE, 'a', 'runs/a/3'))
    assert run_folders(runs / end) == [runs / 'runs/a/1', runs / 'runs/a/3']


def test_a_run_that_a_table_names_often_is_read_once(runs):
    write_table(runs, *[(DONE, 'a', name) for name in ('1', './1', '2', '1')])
    assert run_folders(runs) == [runs / '1', runs / '2']


def test_a_table_of_several_settings_or_of_failures_is_rejected(runs):
    write_table(runs, (DONE, 'b', '1'), (DONE, 'a', '2'))
    with pytest.raises(InputError, match='several settings: .* for example .*runs/a$'):
        run_folders(runs)
    write_table(runs, (FAILED, 'b', '1'))
    with pytest.raises(InputError, match='has no run that was done'):
        run_folders(runs)


@pytest.fixture
def complete(runs):
    """Return a run of two frames, 1 m apart, with all its files but the truth."""
    folder, poses = runs / '10', np.tile(np.eye(4), (2, 1, 1))
    poses[1, 0, 3] = 1.0
    stamps = np.array([2, 3]) * NANOSECONDS
    records = [FrameRecord(int(stamp), Status.OK, '', PoseWithCovariance(pose), 5, 3, {})
               for stamp, pose in zip(stamps, poses)]
    (folder / files.TRAJECTORY).write_text(trajectory_text(Trajectory(stamps, poses)))
    with open(folder / files.FRAMES, 'w', newline='') as file:
        csv.writer(file).writerows([columns([]), *(cells(record, []) for record in records)])
    (folder / files.SUMMARY).write_text(json.dumps({
        'source': 'a room', 'settings': {'a': 1}, 'machine': {'cpu': 'x'}, 'peak_memory_mb': 7}))
    return folder


def test_a_run_is_what_its_files_say(complete):
    run = read_run(complete)
    assert (run.path, run.source, run.settings, run.machine) == (
        complete, 'a room', {'a': 1}, {'cpu': 'x'})
    assert [(record.stamp, record.T_odom_camera[0, 3]) for record in run.records] == [
        (2 * NANOSECONDS, 0.0), (3 * NANOSECONDS, 1.0)]
    assert run.peak_memory_mb == 7
    assert run.ground_truth is None


def test_the_ground_truth_of_a_run_is_read_from_its_own_file(complete):
    moved = (complete / files.TRAJECTORY).read_text().replace('3.000000000 1.0', '3.000000000 5.0')
    (complete / files.GROUND_TRUTH).write_text(moved)
    assert read_run(complete).ground_truth.poses[:, 0, 3].tolist() == [0.0, 5.0]


def test_a_run_of_an_earlier_version_has_no_peak_memory(complete):
    (complete / files.SUMMARY).write_text(json.dumps(SUMMARY))
    assert read_run(complete).peak_memory_mb is None


def test_a_run_without_frames_is_rejected(complete):
    lines = (complete / files.FRAMES).read_text().splitlines()
    (complete / files.FRAMES).write_text(lines[0])
    with pytest.raises(InputError, match=f'{complete / files.FRAMES} has no frames'):
        read_run(complete)


@pytest.mark.parametrize('content', ['', '{', 'null', '[]', 100_000 * '['])
def test_a_summary_that_is_no_json_object_is_named(complete, content):
    (complete / files.SUMMARY).write_text(content)
    with pytest.raises(InputError, match=f'{files.SUMMARY} is not .*; use the folder as aick'):
        read_run(complete)


@pytest.mark.parametrize('change', [
    {'peak_memory_mb': 1e308}, {'peak_memory_mb': 10 ** 400}, {'settings': {'a': float('nan')}},
    {'settings': {'a': [float('inf')]}}])
def test_numbers_that_no_run_writes_are_named(complete, change):
    (complete / files.SUMMARY).write_text(json.dumps({**SUMMARY, **change}))
    with pytest.raises(InputError, match=f'{files.SUMMARY} is not JSON .*; use the folder as'):
        read_run(complete)


@pytest.mark.parametrize('change', [
    {'source': 5}, {'settings': []}, {'machine': None}, {'peak_memory_mb': 'much'}])
def test_a_summary_of_other_types_is_none_of_a_run(runs, change):
    path = runs / '10' / files.SUMMARY
    path.write_text(json.dumps({**SUMMARY, **change}))
    with pytest.raises(InputError, match=f'{path} is not the summary of a run'):
        read_run(runs / '10')


def test_a_table_keeps_numbers_and_makes_text_of_what_has_several_types(tmp_path):
    pytest.importorskip('pyarrow')
    rows = [{'gap': 1, 'set.mode': 'none', 'set.limit': 5}, {'gap': 2.5, 'set.mode': 7}]
    path = tmp_path / TABLE
    path.write_bytes(table_bytes(rows))
    assert read_table(path) == [{'gap': 1.0, 'set.mode': 'none', 'set.limit': 5},
                                {'gap': 2.5, 'set.mode': '7', 'set.limit': None}]
