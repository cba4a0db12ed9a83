# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files for the viewer Rerun, read back by its own reader."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.cli.commands import replay as replay_module
from aick_ros.cli.commands import view as view_module
from aick_ros.cli.output.viewer import _free_port
from aick_ros.geometry.trajectory import read_trajectory
from aick_ros.odometry import Odometry
from aick_ros.sources import raise_damage
from aick_ros.sources.writers.tum_writer import write_tum

rerun = pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')
FRAMES = 6


@pytest.fixture(scope='module')
def folder(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp('recordings') / 'rendered'
    write_tum(path, recording)
    return path


def read(path):
    """Return entity and component -> its values over time."""
    from rerun.chunk import RrdReader
    found = {}
    for chunk in RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns):
            found.setdefault(f'{chunk.entity_path}/{name}', []).extend(column.to_pylist())
    return found


def test_a_recording_is_shown_as_the_odometry_sees_it(aick, folder, tmp_path):
    outcome = aick('view', folder, '--save', 'x.rrd', '--limit', FRAMES)
    assert outcome.code == 0
    assert outcome.sentence == '"rerun x.rrd" opens what was written'
    found = read(tmp_path / 'x.rrd')
    from aick_ros.sources import open_source
    source = open_source(folder)
    frames = [frame for frame, _ in zip(source.frames(raise_damage), range(FRAMES))]
    odometry = Odometry()
    updates = [odometry.register_frame(frame) for frame in frames]
    positions = [update.T_odom_camera[:3, 3] for update in updates]
    np.testing.assert_allclose(
        np.concatenate(found['/world/camera/Transform3D:translation']), positions, atol=1e-6)
    segments = np.concatenate(found['/world/path/LineStrips3D:strips'])
    np.testing.assert_allclose(segments, np.stack([positions[:-1], positions[1:]], 1), atol=1e-6)
    seconds = np.array(found['/world/camera/time'], 'timedelta64[ns]') / np.timedelta64(1, 's')
    np.testing.assert_allclose(seconds, [(f.stamp - frames[0].stamp) / 1e9 for f in frames],
                               atol=1e-6)
    truth = [source.ground_truth.at(frame.stamp) for frame in frames]
    first = updates[0].T_odom_camera @ np.linalg.inv(truth[0])
    errors = [1e3 * np.linalg.norm((np.linalg.inv(first @ true) @ update.T_odom_camera)[:3, 3])
              for true, update in zip(truth, updates)]
    np.testing.assert_allclose(np.ravel(found['/errors/position_mm/Scalars:scalars']), errors,
                               atol=1e-6)
    image = cv2.imdecode(np.array(found['/world/camera/image/EncodedImage:blob'][2],
                                  np.uint8).ravel(), cv2.IMREAD_COLOR)[:, :, ::-1]
    assert np.abs(image.astype(int) - frames[2].colour).mean() < 5
    keypoints = found['/world/camera/image/keypoints/Points2D:positions'][3]
    np.testing.assert_array_equal(keypoints, updates[3].keypoints.pixels)
    assert len(found['/world/camera/image/matches/LineStrips2D:strips'][3]) == len(
        updates[3].matches)
    depth = np.frombuffer(bytes(np.ravel(found['/world/camera/depth/DepthImage:buffer'][1])
                                .astype(np.uint8)), np.uint16).reshape(60, 80)
    expected = np.nan_to_num(frames[1].depth[::4, ::4])
    assert np.abs(depth / 1000 - expected).max() <= 0.001
    assert {'/world/edges/LineStrips3D:strips', '/world/truth/LineStrips3D:strips',
            '/world/covariance/Ellipsoids3D:half_sizes', '/status/changes/TextLog:text',
            '/times/total/Scalars:scalars'} <= found.keys()


def test_a_recording_begins_as_level_as_a_run(aick, pushed, in_memory, tmp_path, monkeypatch):
    """The camera is pushed before the first frame alone, and is level by what follows."""
    for module in (view_module, replay_module):
        monkeypatch.setattr(module, 'open_source', lambda *_: in_memory(pushed))
    options = ('--preset', 'paper-fast', '--set', 'imu.level_sigma=1.0')
    assert aick('view', 'pushed', '--save', 'x.rrd', *options).code == 0
    assert aick('replay', 'pushed', *options).code == 0
    found = read(tmp_path / 'x.rrd')
    written = read_trajectory(tmp_path / 'runs' / 'latest' / 'trajectory.tum').poses
    np.testing.assert_allclose(
        np.concatenate(found['/world/camera/Transform3D:translation']), written[:, :3, 3],
        atol=1e-6)
    rotations = np.array(found['/world/camera/Transform3D:mat3x3']).reshape(-1, 3, 3)
    np.testing.assert_allclose(rotations.transpose(0, 2, 1), written[:, :3, :3], atol=1e-6)
    assert abs(written[0][2, 0]) < 0.15  # of the camera's x axis
    assert len(found['/world/camera/image/EncodedImage:blob']) == len(pushed)


def test_a_sensor_that_is_not_used_is_named_once(aick, stuck, in_memory, monkeypatch):
    monkeypatch.setattr(view_module, 'open_source', lambda *_: in_memory(stuck))
    outcome = aick('view', 'stuck', '--save', 'x.rrd', '--preset', 'paper-fast')
    assert outcome.code == 0
    sentence, end = outcome.err.splitlines()
    assert sentence.startswith('aick: in memory: the accelerometer has reported (0, -9.8, 0.5) ')
    assert 'opens what was written' in end


def test_a_run_is_shown_without_its_recording(aick, folder, tmp_path):
    assert aick('replay', folder, '--limit', FRAMES).code == 0
    assert aick('view', 'runs/latest', '--save', 'run.rrd').code == 0
    found = read(tmp_path / 'run.rrd')
    written = np.loadtxt(tmp_path / 'runs' / 'latest' / 'trajectory.tum')[:, 1:4]
    np.testing.assert_allclose(
        np.concatenate(found['/world/camera/Transform3D:translation']), written, atol=1e-6)
    assert not any('image' in name for name in found)
    for options in (['--set', 'aick.alpha=0.7'], ['--colour-topic', '/x'], ['--limit', '1']):
        outcome = aick('view', 'runs/latest', '--save', 'again.rrd', *options)
        assert outcome.code == 2 and not (tmp_path / 'again.rrd').exists()
        assert outcome.sentence == (
            'runs/latest is the folder of a run, on which options of the odometry or of '
            'recordings, and --limit, have no effect: omit them, or name its recording instead')


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['--save', 'x.rrd', '--web'], '--save and --web exclude each other'),
    (['--save', 'nowhere/x.rrd'], 'the folder nowhere does not exist'),
    (['--save', '/dev/full'], 'cannot write /dev/full: '),
    (['--save', 'x\udcff.rrd'], 'cannot write x\\xff.rrd: its name is not UTF-8'),
    (['--live'], '--live shows a running node: neither a source nor options'),
    ([], 'there is no display for the window of the viewer')])
def test_an_impossible_view_is_rejected(aick, folder, monkeypatch, arguments, sentence):
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    outcome = aick('view', folder, *arguments)
    assert outcome.code == 2
    assert sentence in outcome.sentence


def test_a_full_disk_is_said_at_the_start(aick, folder, monkeypatch, tmp_path):
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: SimpleNamespace(free=10 ** 5))
    outcome = aick('view', folder, '--save', 'x.rrd')
    assert (outcome.code, outcome.sentence) == (
        2, 'cannot write x.rrd: the disk is full; make room there')
    assert not (tmp_path / 'x.rrd').exists()


def test_a_disk_that_fills_is_said_too(aick, folder, monkeypatch):
    free = [10 ** 9, 0]
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: SimpleNamespace(free=free.pop(0)))
    outcome = aick('view', folder, '--save', '/dev/full')
    assert (outcome.code, outcome.sentence) == (
        2, 'cannot write /dev/full: the disk is full; make room there')


def test_a_pipe_that_nobody_reads_is_rejected(aick, folder, tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    outcome = aick('view', folder, '--save', 'pipe')
    assert (outcome.code, outcome.sentence) == (
        2, 'cannot write pipe: it is a pipe that no program reads')


def test_a_pipe_that_is_read_gets_the_whole_view(aick, folder, tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with subprocess.Popen('exec cat pipe > copy', shell=True, cwd=tmp_path) as reader:
        writer = os.open(tmp_path / 'pipe', os.O_WRONLY)  # waits for the reader
        outcome = aick('view', folder, '--save', 'pipe')
        os.close(writer)
        assert outcome.code == 0
        reader.wait(60)
    assert (tmp_path / 'copy').stat().st_size > 10_000


def test_a_recording_of_any_name_is_shown(aick, folder, tmp_path):
    source = tmp_path / 'x\udcff\x1b'
    source.symlink_to(folder)
    outcome = aick('view', source, '--save', 'x.rrd', '--limit', '1')
    assert (outcome.code, outcome.sentence) == (0, '"rerun x.rrd" opens what was written')


def test_an_earlier_view_stays_where_the_recording_cannot_be_read(aick, tmp_path):
    (tmp_path / 'rgb.txt').write_text('1.0 rgb/1.png\n')
    (tmp_path / 'depth.txt').write_text('1.0 depth/1.png\n')
    (tmp_path / 'camera.json').write_text('{"width": 4, "height": 4, "k": [4,0,2,0,4,2,0,0,1]}')
    (tmp_path / 'x.rrd').write_text('another view')
    outcome = aick('view', tmp_path, '--save', 'x.rrd')
    assert outcome.code == 2
    assert (tmp_path / 'x.rrd').read_text() == 'another view'
    assert not list(tmp_path.glob('.x.rrd*'))


def test_rerun_adds_no_lines_where_a_file_cannot_be_written(folder, tmp_path):
    limited = 'ulimit -f 4; trap "" XFSZ; exec "$@"'
    run = subprocess.run(
        ['bash', '-c', limited, 'bash', sys.executable, '-m', 'aick_ros', 'view', folder,
         '--save', 'x.rrd'], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 2
    assert re.fullmatch('aick: cannot write x.rrd: .*\n', run.stderr)
    assert list(tmp_path.iterdir()) == []


def test_a_browser_gets_the_data_on_this_machine_only(folder):
    command = [sys.executable, '-m', 'aick_ros', 'view', folder, '--limit', '2', '--web']
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        said = next(line for line in process.stderr if 'the viewer is at' in line)
        port = int(re.search(r'127\.0\.0\.1%3A(\d+)', said)[1])
        sockets = [line.split() for line in Path('/proc/net/tcp').read_text().splitlines()[1:]]
        listening = [local for _, local, _, state, *_ in sockets if state == '0A']
        assert [each for each in listening if each.endswith(f':{port:04X}')] == [
            f'0100007F:{port:04X}']
        next(line for line in process.stderr if 'Ctrl-C' in line)
        process.send_signal(signal.SIGINT)
    assert process.returncode == 0


@pytest.mark.parametrize(('arguments', 'sentence'), [
    ([], 'nothing to show: name a recording or a run, or give --live'),
    (['--live', '--set', 'aick.alpha=0.7'], '--live shows a running node'),
    (['x.bag', '--namespace', 'robot'], '--namespace and --remap are those of a running node'),
    (['x.bag', '--remap', 'odom:=x'], '--namespace and --remap are those of a running node'),
    (['--live', '--remap', 'odom', '--save', 'x.rrd'], "ROS rejects these .*'--remap odom'"),
    (['--live', '--colour-topic', '/image'], '--live shows a running node'),
    (['--live', '--namespace', 'a b', '--save', 'x.rrd'], '--namespace a b: Invalid .*[^:]$'),
    (['--live', '--namespace', '\udcff', '--save', 'x.rrd'], 'letters, digits, _ and / are')])
def test_an_impossible_live_view_is_rejected(aick, tmp_path, arguments, sentence, ros_domain):
    (tmp_path / 'x.rrd').write_text('another view')
    outcome = aick('view', *arguments)
    assert outcome.code == 2
    assert (tmp_path / 'x.rrd').read_text() == 'another view'
    assert re.search(sentence, outcome.sentence)


def test_without_rerun_the_extra_is_named(aick, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, 'rerun', None)
    outcome = aick('view', folder, '--save', 'x.rrd')
    assert outcome.code == 2
    assert "no view without rerun: pip install '.[view]'" in outcome.sentence


def test_a_port_that_another_program_has_is_not_taken():
    with socket.create_server(('', 0)) as other:
        port = other.getsockname()[1]
        assert _free_port(port) != port
    assert _free_port(port) == port


@pytest.mark.parametrize('hears_after, hint', [(4.9, False), (5.1, True), (99.0, True)])
def test_a_node_that_is_not_heard_is_hinted_at_once(monkeypatch, capfd, hears_after, hint):
    """After five seconds, and that it is there when it is."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(view_module, 'time', SimpleNamespace(monotonic=lambda: clock.now))
    watcher = SimpleNamespace(hears=False, topic='/robot/odom')
    hints, said = view_module._hints(watcher), []
    for _ in range(100):
        watcher.hears = clock.now >= 100.0 + hears_after
        next(hints, None)
        said += [(clock.now - 100.0, line) for line in capfd.readouterr().err.splitlines()]
        clock.now += 0.1
    there = 'aick: odom_node is there: /robot/odom is shown'
    missing = ('aick: no odom_node publishes /robot/odom yet: does it run, with this '
               'ROS_DOMAIN_ID and namespace, and are its topics remapped (--remap)?')
    assert [line for _, line in said] == [missing] * hint + [there] * (hears_after < 99.0)
    assert all(time == pytest.approx(5.0, abs=0.11) for time, line in said if line == missing)


@pytest.mark.parametrize('limit, gone, frames, end', [
    (20, (2.0, 99.0), 15, 7.0), (20, (2.0, 6.5), 15, None), (10, (99.0, 99.0), 15, 1.0),
    (None, (2.0, 99.0), 15, None)])
def test_a_limited_view_ends_with_its_node(monkeypatch, capfd, limit, gone, frames, end):
    """Five seconds after it, so that a node that is started again goes on; ten frames a second."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(view_module, 'time', SimpleNamespace(monotonic=lambda: clock.now))
    watcher = SimpleNamespace(frames=0, is_alone=False, topic='/odom')
    ends, ended = view_module._ends(watcher, limit), None
    for step in range(100):
        watcher.frames = min(step, frames)
        watcher.is_alone = gone[0] <= step / 10 < gone[1]
        if next(ends) and ended is None:
            ended = step / 10
        clock.now += 0.1
    assert ended == (None if end is None else pytest.approx(end, abs=0.11))
    said = capfd.readouterr().err
    assert said == ('aick: odom_node has ended: nobody publishes /odom any more, so --limit 20 is '
                    'not reached\n' if end == 7.0 else '')
