# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Output of a replay, complete or interrupted."""

import csv
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from evo.tools import file_interface

from aick_ros.cli.commands import replay as replay_module
from aick_ros.cli.input.options import settings_from
from aick_ros.cli.output import plot_folder
from aick_ros.cli.output.run_folder import RunFolder, link_latest, make_folder
from aick_ros.errors import InputError
from aick_ros.evaluation.runs.frames_csv import columns
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.geometry.trajectory import Trajectory, read_trajectory, stamp_to_seconds
from aick_ros.odometry import Odometry
from aick_ros.registration.stage_times import STAGES
from aick_ros.registration.status import Status
from aick_ros.reports import canvas
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values
from aick_ros.settings.presets import preset
from aick_ros.sources import raise_damage
from aick_ros.sources.writers.tum_writer import write_tum

ROOT = Path(__file__).parents[3]
FILES = {'trajectory.tum', 'frames.csv', 'settings.yaml', 'summary.json', 'report.html'}


@pytest.fixture
def replay(aick, monkeypatch, tmp_path):
    """Return a function that replays a source in memory and returns outcome and run folder."""
    def run(source, *arguments):
        monkeypatch.setattr(replay_module, 'open_source', lambda path, options: source)
        outcome = aick('replay', 'a source', *arguments)
        return outcome, tmp_path / 'runs' / 'latest'
    return run


def rows(run):
    with open(run / 'frames.csv', newline='') as file:
        return list(csv.DictReader(file))


def summary(run):
    return json.loads((run / 'summary.json').read_text())


def assert_whole(run, frames):
    """All files are there, readable and of the same frames."""
    assert {path.name for path in run.iterdir()} - {'ground_truth.tum'} == FILES
    assert len(read_trajectory(run / 'trajectory.tum')) == frames
    assert len(rows(run)) == frames
    assert all(None not in row.values() for row in rows(run))
    assert summary(run)['frames'] == frames
    assert (run / 'report.html').read_text().rstrip().endswith('</html>')


@pytest.fixture(scope='module')
def updates(recording):
    odometry = Odometry(preset('paper-fast'))
    return [odometry.register_frame(frame) for frame in recording.frames(raise_damage)]


@pytest.fixture(scope='module')
def replayed():
    """Return a place for the outcome and the folder of a run that several tests read."""
    return []


@pytest.fixture
def paper_fast(replay, recording, replayed, draw, monkeypatch):
    """Return outcome and folder of a replay of the whole recording, its report with pictures."""
    if not replayed:
        monkeypatch.setattr(canvas, 'to_svg', draw)
        replayed.extend(replay(recording, '--preset', 'paper-fast'))
        replayed[1] = replayed[1].resolve()
    return replayed


def test_files_have_the_values_of_the_odometry(paper_fast, recording, updates):
    outcome, run = paper_fast
    assert outcome.code == 0
    assert outcome.err == ''
    assert_whole(run, len(updates))
    assert '<path' in (run / 'report.html').read_text()
    np.testing.assert_allclose(read_trajectory(run / 'ground_truth.tum').poses,
                               recording.ground_truth.poses, atol=2e-9)
    path = read_trajectory(run / 'trajectory.tum')
    np.testing.assert_array_equal(path.stamps, [update.stamp for update in updates])
    np.testing.assert_allclose(path.poses, [update.T_odom_camera for update in updates],
                               atol=2e-9)
    for row, update in zip(rows(run), updates):
        assert tuple(row) == columns([*STAGES, 'total'])
        assert row['stamp'] == stamp_to_seconds(update.stamp)
        assert row['status'] == update.status.name
        assert (int(row['keypoints']), int(row['matches'])) == (
            len(update.keypoints), len(update.matches))
        assert float(row['pose_variance_rot_z']) == pytest.approx(
            update.pose.covariance[5, 5], rel=1e-5)
        if update.increment:
            moved = update.increment.pose
            assert float(row['increment_y']) == pytest.approx(moved.matrix[1, 3], abs=1e-9)
            assert float(row['increment_variance_x']) == pytest.approx(
                moved.covariance[0, 0], rel=1e-5)
        else:
            assert row['increment_y'] == row['increment_variance_x'] == ''
    assert summary(run)['trajectory']['ate_rmse_m'] == pytest.approx(
        np.sqrt(np.mean(compare(path, recording.ground_truth).positions() ** 2)), abs=1e-6)
    assert 'ATE' in outcome.out


def test_a_sensor_that_is_not_used_is_named_once(replay, recording, stuck, in_memory):
    outcome, _ = replay(in_memory(stuck, recording.ground_truth), '--preset', 'paper-fast')
    assert outcome.code == 0
    (sentence,) = outcome.err.splitlines()
    assert 'the accelerometer has reported (0, -9.8, 0.5) m/s^2 for 0.' in sentence


@pytest.mark.parametrize('wait', [0.0, 10.0])
def test_it_begins_level_by_all_that_was_measured_meanwhile(
        replay, recording, pushed, in_memory, wait):
    """The camera is pushed before the first frame alone, and is level by what follows."""
    outcome, run = replay(in_memory(pushed, recording.ground_truth), '--preset', 'paper-fast',
                          '--set', 'imu.level_sigma=1.0', '--set', f'imu.level_wait={wait}')
    assert outcome.code == 0
    path = read_trajectory(run / 'trajectory.tum')
    np.testing.assert_array_equal(path.stamps, [frame.stamp for frame in pushed])
    assert (abs(path.poses[0][2, 0]) < 0.15) == bool(wait)  # of the camera's x axis


def test_covariances_are_written_whole(paper_fast, updates):
    def matrix(row, of):
        values = [float(row[name]) for name in row if name.startswith(f'{of}_cov_')]
        upper = np.zeros((6, 6))
        upper[np.triu_indices(6)] = values
        return upper + np.triu(upper, 1).T

    _, run = paper_fast
    for row, update in zip(rows(run), updates):
        assert float(row['pose_cov_xz']) == pytest.approx(update.pose.covariance[0, 2], rel=1e-9)
        assert float(row['pose_cov_yrx']) == pytest.approx(update.pose.covariance[1, 3], rel=1e-9)
        assert float(row['pose_cov_rxrz']) == pytest.approx(update.pose.covariance[3, 5], rel=1e-9)
        np.testing.assert_allclose(matrix(row, 'pose'), update.pose.covariance, rtol=1e-6,
                                   atol=1e-15)
        if update.increment:
            np.testing.assert_allclose(
                matrix(row, 'increment'), update.increment.pose.covariance, rtol=1e-6, atol=1e-15)
        else:
            assert {row[name] for name in row if name.startswith('increment_cov_')} == {''}


def test_stages_are_columns(tmp_path, updates):
    timing = {'features': 1.0, 'refinement': 2.0, 'total': 3.0}
    with RunFolder(tmp_path, 'source', Settings(), datetime.now()) as folder:
        for update in updates[:2]:
            folder.add(FrameRecord.of(dataclasses.replace(update, timing=timing)))
    assert [row['refinement_ms'] for row in rows(folder.path)] == ['2.000', '2.000']
    assert [name for name in rows(folder.path)[0] if name.endswith('_ms')] == [
        'features_ms', 'refinement_ms', 'total_ms']


def test_evo_reads_the_trajectory(paper_fast, updates):
    _, run = paper_fast
    path = file_interface.read_tum_trajectory_file(run / 'trajectory.tum')
    assert path.num_poses == len(updates)
    assert path.check()[0]
    np.testing.assert_allclose(path.positions_xyz[-1], updates[-1].T_odom_camera[:3, 3],
                               atol=1e-8)
    assert path.timestamps[0] == pytest.approx(updates[0].stamp / 1e9, abs=1e-6)


def test_settings_can_be_used_again(replay, recording):
    _, run = replay(recording, '--preset', 'paper-full', '--set', 'sensor.depth_sigma=1e-5',
                    '--limit', '2')
    expected = settings_from('paper-full', None, ['sensor.depth_sigma=1e-5'])
    assert settings_from(None, run / 'settings.yaml', None) == expected
    assert summary(run)['settings'] == json.loads(json.dumps(values(expected)))


def test_same_source_same_files(replay, recording):
    def content():
        _, run = replay(recording)
        lines = [{name: value for name, value in row.items() if not name.endswith('_ms')}
                 for row in rows(run)]
        return (run / 'trajectory.tum').read_bytes(), lines

    assert content() == content()


def test_a_file_called_latest_stays(tmp_path):
    (tmp_path / 'latest').write_text('mine')
    link_latest(tmp_path / 'run')
    assert (tmp_path / 'latest').read_text() == 'mine'
    assert os.listdir(tmp_path) == ['latest']


def test_runs_lie_side_by_side_and_latest_is_the_last(replay, recording, tmp_path):
    for limit in (1, 2, 3):
        _, run = replay(recording, '--limit', limit)
        assert_whole(run, limit)
    runs = [path for path in (tmp_path / 'runs').iterdir() if path.name != 'latest']
    assert len(runs) == 3
    assert (tmp_path / 'runs' / 'latest').is_symlink()
    assert all(path.name.startswith('in_memory-20') for path in runs)


def test_json_alone_on_standard_output(replay, recording):
    outcome, run = replay(recording, '--limit', '3', '--json', '-')
    assert json.loads(outcome.out) == summary(run)
    assert 'path length' in outcome.err


def test_json_into_a_file(replay, recording, tmp_path):
    outcome, run = replay(recording, '--limit', '3', '--json', tmp_path / 'figures.json')
    assert json.loads((tmp_path / 'figures.json').read_text()) == summary(run)
    assert 'path length' in outcome.out


def test_without_ground_truth_nothing_is_made_up(replay, recording, in_memory):
    outcome, run = replay(in_memory(list(recording.frames(raise_damage))[:4]))
    assert outcome.code == 0
    assert summary(run)['trajectory']['ate_rmse_m'] is None
    assert 'ATE' not in outcome.out


@pytest.mark.parametrize('count, is_said', [(6, True), (None, False)])
def test_an_ate_of_a_part_of_the_frames_says_so(replay, recording, in_memory, count, is_said):
    truth = recording.ground_truth
    cut = Trajectory(truth.stamps[:count], truth.poses[:count])
    outcome, run = replay(in_memory(list(recording.frames(raise_damage)), cut))
    covered = summary(run)['trajectory']['covered_frames']
    assert covered == (count or len(recording)) and 'ATE' in outcome.out
    row = ' '.join(outcome.out.split())
    assert (f'frames with ground truth {covered} of {len(recording)} RPE' in row) is is_said


@pytest.mark.parametrize('command', ['replay', 'evaluate'])
def test_depth_in_a_wrong_unit_is_named(command, aick, recording, in_memory, monkeypatch):
    source = in_memory([dataclasses.replace(frame, depth=1000 * frame.depth)
                        for frame in list(recording.frames(raise_damage))[:3]])
    monkeypatch.setattr(f'aick_ros.cli.commands.{command}.open_source', lambda *given: source)
    outcome = aick(command, 'a source')
    told = outcome.err.splitlines()[-1]
    assert outcome.code == 2
    assert told.startswith('aick: no frame of in memory was tracked: too few keypoints')
    assert told.endswith('images of 32FC1 must be in metres, of 16UC1 in millimetres')


def test_damaged_images_are_skipped_and_named(aick, recording, tmp_path):
    folder = tmp_path / 'tum'
    write_tum(folder, recording)
    colour = sorted((folder / 'rgb').iterdir())
    depth = sorted((folder / 'depth').iterdir())
    colour[3].write_bytes(colour[3].read_bytes()[:2000])
    depth[6].unlink()
    colour[0].write_bytes(b'')
    outcome = aick('replay', folder)
    lines = outcome.err.splitlines()
    assert outcome.code == 2
    assert [name in line for name, line in zip(
        (colour[0].name, colour[3].name, depth[6].name), lines)] == [True] * 3
    assert lines[3].startswith('aick: 3 images were skipped')
    assert len(lines) == 4
    assert_whole(tmp_path / 'runs' / 'latest', len(recording) - 3)
    assert summary(tmp_path / 'runs' / 'latest')['damaged_images'] == 3


def test_much_damage_is_counted_not_listed(replay, recording, in_memory):
    def damaged(index, on_damaged):
        for _ in range(5):
            on_damaged(InputError(f'torn before {index}'))

    source = in_memory(list(recording.frames(raise_damage)), on_frame=damaged)
    outcome, run = replay(source, '--limit', 4)
    assert outcome.code == 2
    assert len(outcome.err.splitlines()) == 7
    assert f'{summary(run)["damaged_images"]} images were skipped' in outcome.err
    assert summary(run)['damaged_images'] >= 20
    assert_whole(run, 4)


def test_a_recording_that_breaks_off_leaves_whole_files(replay, recording, in_memory):
    def broken(index, on_damaged):
        if index == 5:
            raise InputError('a.mcap ends in a torn message: record it again')

    outcome, run = replay(in_memory(list(recording.frames(raise_damage)), on_frame=broken))
    assert outcome.code == 2
    assert outcome.sentence == 'a.mcap ends in a torn message: record it again'
    assert_whole(run, 5)
    assert summary(run)['ended'] == outcome.sentence


def test_a_full_disk_ends_the_run_as_a_torn_recording_does(
        replay, recording, monkeypatch, tmp_path):
    add, added = RunFolder.add, []

    def fail_later(folder, record):
        if len(added) == 5:
            raise InputError('cannot write frames.csv: No space left on device')
        added.append(record)
        add(folder, record)

    monkeypatch.setattr(RunFolder, 'add', fail_later)
    outcome, run = replay(recording, '--json', tmp_path / 'figures.json')
    assert outcome.code == 2
    assert outcome.sentence == 'cannot write frames.csv: No space left on device'
    assert_whole(run, 5)
    assert json.loads((tmp_path / 'figures.json').read_text()) == summary(run)
    assert summary(run)['ended'] == outcome.sentence


@pytest.mark.parametrize('name', ['summary.json', 'report.html'])
def test_figures_on_another_disk_are_written_where_that_of_the_run_is_full(
        replay, recording, monkeypatch, tmp_path, name):
    def full(*given):
        raise InputError(f'cannot write {name}: No space left on device')
    if name == 'summary.json':
        monkeypatch.setattr(RunFolder, 'write_summary', full)
    else:
        monkeypatch.setattr(replay_module, '_write_report', full)
    outcome, _ = replay(recording, '--limit', '3', '--json', tmp_path / 'figures.json')
    assert (outcome.code, name in outcome.sentence) == (2, True)
    assert json.loads((tmp_path / 'figures.json').read_text())['frames'] == 3


@pytest.mark.parametrize('damage', [True, False])
def test_a_recording_without_frames_leaves_nothing(replay, recording, in_memory, damage, tmp_path):
    class Empty(in_memory):
        def frames(self, on_damaged):
            if damage:
                on_damaged(InputError('torn'))
            yield from ()

    outcome, _ = replay(Empty([]))
    assert outcome.code == 2
    assert 'in memory has no usable frame' in outcome.err
    assert not (tmp_path / 'runs').exists()


def test_a_place_that_cannot_be_written(replay, recording, tmp_path):
    (tmp_path / 'file').write_text('')
    outcome, _ = replay(recording, '--out', tmp_path / 'file')
    assert outcome.code == 2
    assert f'cannot make a folder in {tmp_path / "file"}: Not a dir' in outcome.sentence


def test_a_place_in_too_many_folders(tmp_path):
    with pytest.raises(InputError, match='cannot make the folder .*: it has too many folders'):
        make_folder(tmp_path / ('d/' * 1500), 'source', datetime(2026, 1, 1))
    with pytest.raises(InputError, match='--plots .*: it has too many folders'):
        plot_folder.make_folder(tmp_path / ('d/' * 1500), '--plots')
    assert list(tmp_path.iterdir()) == []


def test_runs_without_matplotlib(replay, recording, monkeypatch):
    for name in [name for name in sys.modules
                 if name.startswith(('matplotlib', 'aick_ros.reports'))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    outcome, run = replay(recording, '--limit', '2')
    assert outcome.code == 0
    assert outcome.sentence == ("no report.html without matplotlib: pip install '.[eval]' in the "
                                'folder of aick_ros')
    assert {path.name for path in run.iterdir()} == FILES - {'report.html'} | {'ground_truth.tum'}


def test_every_line_is_written_before_the_next_frame(tmp_path, updates):
    with RunFolder(tmp_path, 'source', Settings(), datetime.now()) as folder:
        for count, update in enumerate(updates, 1):
            folder.add(FrameRecord.of(update))
            assert len(read_trajectory(folder.path / 'trajectory.tum')) == count
            assert len(rows(folder.path)) == count


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('ending', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_leaves_whole_files(tmp_path, recording, ending):
    write_tum(tmp_path / 'long', recording)
    repeat(tmp_path / 'long', 1000)
    process = subprocess.Popen(
        [sys.executable, '-m', 'aick_ros', 'replay', 'long'], cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True)
    run = tmp_path / 'runs' / 'latest'
    deadline = time.monotonic() + 120
    while not (run / 'frames.csv').exists() or len(rows(run)) < 2:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(ending)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert 'interrupted' in err
    assert 'interrupted' in out
    assert_whole(run, summary(run)['frames'])
    assert 2 <= summary(run)['frames'] < 1000
    assert summary(run)['ended'] == 'interrupted'


def repeat(folder, count):
    """Let the lists of a TUM folder name its images again and again, at 12 Hz."""
    for part in ('rgb', 'depth'):
        files = sorted((folder / part).iterdir())
        (folder / f'{part}.txt').write_text(''.join(
            f'{1000 + i / 12:.6f} {part}/{files[i % len(files)].name}\n' for i in range(count)))


def made(**changed):
    """Return the summary of a run of 200 frames, three of which are lost, with errors."""
    return SimpleNamespace(**{
        'source': 'desk', 'frames': 200, 'tracked': 197, 'frames_per_second': 59.94,
        'path_length_m': 12.3456, 'end_distance_m': 0.5, 'ended': 'complete',
        'damaged_images': 0,
        'status': {'FIRST_FRAME': 1, 'OK': 196, 'TOO_FEW_MATCHES': 2, 'MOTION_GATE': 1},
        'trajectory': TrajectoryScore(0.01234, 1.239, 0.0567, 0.985), **changed})


def shown(monkeypatch, of, on_stderr=False):
    tables = []
    monkeypatch.setattr(replay_module, 'table', lambda title, rows, on_stderr: tables.append(
        (title, dict(rows), on_stderr)))
    replay_module._show(of, Path('runs/desk'), on_stderr)
    return tables.pop()


def test_the_table_has_each_figure_with_its_unit(monkeypatch):
    assert shown(monkeypatch, made()) == ('desk', {
        'frames': '200', 'tracked': '197 (98.5 %)', 'frames per second': '59.9',
        'path length': '12.346 m', 'start to end': '0.500 m',
        'not tracked': f'2 too few matches, 1 {Status.MOTION_GATE.value}',
        'RPE over 1 s, translation': '0.0123 m', 'RPE over 1 s, rotation': '1.24 deg',
        'ATE': '0.0567 m', 'files': 'runs/desk'}, False)


def test_what_there_is_not_has_no_row(monkeypatch):
    plain = ['frames', 'tracked', 'frames per second', 'path length', 'start to end', 'files']
    whole = made(status={'OK': 200}, trajectory=TrajectoryScore(None, None, None, 1.0))
    assert list(shown(monkeypatch, whole)[1]) == plain
    # the only pose is the one that is aligned
    lost = made(tracked=1, status={'FIRST_FRAME': 1})
    assert list(shown(monkeypatch, lost)[1]) == plain
    broken = shown(monkeypatch, made(status={}, ended='the bag is torn'), on_stderr=True)
    assert broken[1]['ended'] == 'the bag is torn' and broken[2] is True
    assert shown(monkeypatch, made(damaged_images=15))[1]['images skipped'] == '15'


def test_a_mask_that_cannot_be_used_is_one_sentence(replay, recording, tmp_path):
    outcome, _ = replay(recording, '--set', 'sensor.mask=none.png')
    assert outcome.code == 2
    assert outcome.sentence == (
        f'cannot read the mask (sensor.mask) {tmp_path}/none.png: No such file or directory; '
        'name a PNG file that can be read, or none to use all of the images')
    cv2.imwrite(str(tmp_path / 'mask.png'), np.full((100, 100), 255, np.uint8))
    outcome, _ = replay(recording, '--set', 'sensor.mask=mask.png')
    assert outcome.code == 2
    assert outcome.sentence.startswith(
        f'the mask {tmp_path}/mask.png (sensor.mask) has 100 x 100 pixels and the images 320 x '
        '240: ')
    outcome, _ = replay(recording, '--set', 'sensor.roi_ratios=0 0 0 0.25')
    assert outcome.code == 0
