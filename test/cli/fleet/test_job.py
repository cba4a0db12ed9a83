# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The row and the folder of a run against its recording."""

import json
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.cli.fleet import job as job_module
from aick_ros.cli.fleet.job import Job, run_job
from aick_ros.cli.fleet.scratch import ScratchSpace
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import SourceOptions, raise_damage
from aick_ros.sources.writers.tum_writer import write_tum


@pytest.fixture
def folder(recording, tmp_path):
    write_tum(tmp_path / 'desk', recording)
    return tmp_path / 'desk'


def finish(folder, **options):
    return run_job(Job(str(folder), 'settings', Settings(), **{'gaps': [1], **options}))


def test_the_figures_are_those_of_the_recording(folder, recording, monkeypatch):
    threads = []
    monkeypatch.setattr(cv2, 'setNumThreads', threads.append)
    finished = finish(folder, limit=5)
    stamps = [frame.stamp for frame in recording.frames(raise_damage)][:5]
    positions = [recording.ground_truth.at(stamp)[:3, 3] for stamp in stamps]
    length = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    figures = finished.figures
    assert finished.recording == 'desk'
    assert figures['duration_s'] == pytest.approx((stamps[-1] - stamps[0]) / 1e9, abs=1e-6)
    assert figures['path_length_m'] == pytest.approx(length, rel=0.1)
    assert (figures['frames'], figures['tracked']) == (5, 5)
    assert (figures['ended'], figures['damaged_images']) == ('complete', 0)
    assert figures['unused_sensors'] == figures['remarks'] == ''
    assert figures['wall_time_s'] > 0 < figures['peak_memory_mb']
    assert {'source', 'settings', 'machine', 'bytes_copied'}.isdisjoint(figures)
    assert threads == [1]


def test_the_folder_of_the_run_has_its_path_and_the_true_one(folder, recording, tmp_path):
    finished = finish(folder, limit=5)
    for name, content in finished.files.items():
        (tmp_path / name).write_bytes(content)
    assert len(np.loadtxt(tmp_path / 'trajectory.tum')) == 5
    truth = np.loadtxt(tmp_path / 'ground_truth.tum')
    np.testing.assert_allclose(truth[:, 1:4], recording.ground_truth.poses[:, :3, 3], atol=1e-5)
    summary = json.loads(finished.files['summary.json'])
    assert summary['source'] == 'desk'


def test_a_job_has_one_thread(recording, in_memory, monkeypatch):
    threads = set()
    frames = list(recording.frames(raise_damage))
    source = in_memory(frames, on_frame=lambda *_: threads.add(threading.current_thread()))
    monkeypatch.setattr(job_module, 'open_source', lambda *options: source)
    finish('desk', limit=2)
    assert threads == {threading.current_thread()}


def test_without_true_path_there_is_none(folder):
    (folder / 'groundtruth.txt').unlink()
    finished = finish(folder, limit=3)
    assert 'ground_truth.tum' not in finished.files
    assert finished.figures['tracked'] == 3


def test_damaged_images_are_counted(folder):
    images = sorted((folder / 'rgb').iterdir())
    for image in images[3:5]:
        image.write_bytes(image.read_bytes()[:100])
    start = time.perf_counter()
    finished = finish(folder)
    assert 0 < finished.figures['wall_time_s'] < time.perf_counter() - start
    assert finished.figures['damaged_images'] == 2
    assert finished.figures['frames'] == len(images) - 2
    said = finished.figures['remarks']
    assert said.startswith('2 images skipped, the first of each reason: ')
    assert images[3].name in said and images[4].name not in said
    summary = json.loads(finished.files['summary.json'])
    assert summary['damaged_images'] == 2
    assert summary['wall_time_s'] == finished.figures['wall_time_s']


def test_a_sensor_that_is_not_used_is_named_once(recording, stuck, in_memory, monkeypatch):
    source = in_memory(stuck, recording.ground_truth)
    monkeypatch.setattr(job_module, 'open_source', lambda *options: source)
    said = finish('desk').figures['unused_sensors']
    assert said.startswith('the accelerometer has reported (0, -9.8, 0.5) m/s^2 for ')
    assert said.count('the accelerometer') == 1


def test_what_a_source_remarks_is_in_the_row(recording, in_memory, monkeypatch):
    source = in_memory(list(recording.frames(raise_damage)), recording.ground_truth)
    source.remarks = ['desk: the IMU has another clock', 'two drivers publish']
    monkeypatch.setattr(job_module, 'open_source', lambda *options: source)
    assert finish('desk', limit=2).figures['remarks'] == (
        'the IMU has another clock; two drivers publish')


def test_a_recording_without_a_usable_frame_says_why(folder):
    """Nobody has seen the images that were skipped: they are only counted in a fleet."""
    images = sorted((folder / 'depth').iterdir())
    for image in images:
        image.unlink()
    with pytest.raises(InputError, match='desk has no usable frame; the first image that was '
                       f'skipped: cannot read the image .*{images[0].name}: No such file'):
        finish(folder)


@pytest.mark.parametrize('content, cells', [
    ({'a': {'b': 1, 'c': {'d': 'x'}}, 'e': None}, {'a.b': 1, 'a.c.d': 'x', 'e': None}),
    ({'a': [1, 2], 'b': {'c': []}, 'd': True}, {'d': True}), ({1: 0.5}, {'1': 0.5}), ({}, {})])
def test_names_of_columns_are_dotted(content, cells):
    assert dict(job_module._flat(content, '')) == cells


def test_what_a_job_asks_for_is_done_with_the_recording(monkeypatch, recording, tmp_path):
    opened, settings = [], with_values(Settings(), {'aick.iterations': 7})
    monkeypatch.setattr(job_module, 'open_source', lambda *asked: (
        opened.append(asked), recording)[1])
    options = SourceOptions(max_interval=0.07)
    finished = run_job(Job('desk', 'a', settings, options, [2, 3], 6))
    assert opened == [('desk', options)]
    assert (finished.recording, finished.figures['frames']) == ('in memory', 6)
    pairs = {name: value for name, value in finished.figures.items()
             if name.startswith('pairs.') and name.endswith('.count')}
    assert pairs == {'pairs.2.count': 4, 'pairs.3.count': 3}
    assert b'iterations: 7' in finished.files['settings.yaml']
    summary = json.loads(finished.files['summary.json'])
    assert summary['settings']['aick.iterations'] == 7
    assert sorted(finished.files) == ['frames.csv', 'ground_truth.tum', 'settings.yaml',
                                      'summary.json', 'trajectory.tum']
    for name in ('ended', 'duration_s', 'tracked', 'path_length_m', 'peak_memory_mb'):
        assert finished.figures[name] == summary[name]


def test_a_url_is_copied_first_and_its_bytes_are_counted(monkeypatch, recording):
    class Scratch:
        def __init__(self, space):
            self.space = space

        @contextmanager
        def copy_of(self, url):
            asked.append((self.space, url))
            yield SimpleNamespace(path=Path('copy'), bytes_copied=123)

    asked, space = [], ScratchSpace(limit=5)
    monkeypatch.setattr(job_module, 'scratch_of', Scratch)
    monkeypatch.setattr(job_module, 'open_source', lambda path, options: (
        asked.append(path), recording)[1])
    job = Job('s3://bucket/desk', 'a', Settings(), gaps=[1], limit=2, scratch=space)
    assert run_job(job).figures['bytes_copied'] == 123
    assert asked == [(space, 's3://bucket/desk'), Path('copy')]


def test_remarks_on_a_copy_name_its_url(monkeypatch, recording, in_memory):
    class Scratch:
        def __init__(self, space):
            pass

        @contextmanager
        def copy_of(self, url):
            yield SimpleNamespace(path=Path('/tmp/copy.mcap'), bytes_copied=4)

    source = in_memory(list(recording.frames(raise_damage)), on_frame=lambda index, on_damaged: (
        on_damaged(InputError('/tmp/copy.mcap, /rgb: no stamp')) if index == 1 else None))
    monkeypatch.setattr(job_module, 'scratch_of', Scratch)
    monkeypatch.setattr(job_module, 'open_source', lambda *options: source)
    figures = run_job(Job('https://h/a.mcap', 'a', Settings(), gaps=[1], limit=2)).figures
    assert figures['remarks'].endswith(': https://h/a.mcap, /rgb: no stamp')


def test_what_is_wrong_with_a_copy_is_that_of_the_url(monkeypatch, tmp_path):
    """The copy does not stay."""
    class Scratch:
        def __init__(self, space):
            pass

        @contextmanager
        def copy_of(self, url):
            yield SimpleNamespace(path=tmp_path / 'a.mcap', bytes_copied=4)

    (tmp_path / 'a.mcap').write_bytes(b'none')
    monkeypatch.setattr(job_module, 'scratch_of', Scratch)
    with pytest.raises(InputError) as raised:
        run_job(Job('https://h/a.mcap', 'a', Settings()))
    assert str(raised.value).startswith('https://h/a.mcap cannot be read as a bag')
    assert str(tmp_path) not in str(raised.value)
