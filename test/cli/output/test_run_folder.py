# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder of a run that is whole, or is not there."""

import csv
import json
import os
from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.cli.output.run_folder import RunFolder, link_latest, make_folder, whole_folder
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory, read_trajectory
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

STARTED = datetime(2026, 1, 2, 3, 4, 5)


@pytest.mark.parametrize('error', [KeyboardInterrupt, RuntimeError])
def test_nothing_is_left_of_a_run_that_fails(tmp_path, error):
    with pytest.raises(error), whole_folder(tmp_path / 'deep' / 'runs', 'x', STARTED) as folder:
        (folder / 'bag').mkdir()
        (folder / 'bag' / 'bag.mcap').touch()
        raise error
    assert os.listdir(tmp_path) == []


def test_latest_stays_with_the_last_whole_run(tmp_path):
    with whole_folder(tmp_path, 'x', STARTED) as whole:
        (whole / 'trajectory.tum').touch()
    with pytest.raises(KeyboardInterrupt), whole_folder(tmp_path, 'x', STARTED) as folder:
        assert folder != whole
        raise KeyboardInterrupt
    assert sorted(os.listdir(tmp_path)) == ['latest', whole.name]
    assert (tmp_path / 'latest' / 'trajectory.tum').is_file()


def record(second, **timing):
    pose = np.eye(4)
    pose[0, 3] = second
    return FrameRecord(second * NANOSECONDS, Status.OK, '', PoseWithCovariance(pose), 5, 3, timing)


def test_each_frame_is_in_both_files_as_soon_as_it_is_added(tmp_path):
    with RunFolder(tmp_path, 'x', Settings(), STARTED) as folder:
        for second, timing in ((1, {'features': 1.5}), (2, {'features': 2.5, 'late': 9.0})):
            folder.add(record(second, **timing))
            poses = read_trajectory(folder.path / 'trajectory.tum')
            assert poses.stamps.tolist() == [i * NANOSECONDS for i in range(1, second + 1)]
            assert poses.poses[:, 0, 3].tolist() == list(range(1, second + 1))
            with open(folder.path / 'frames.csv', newline='') as file:
                lines = list(csv.DictReader(file))
            assert [line['features_ms'] for line in lines] == ['1.500', '2.500'][:second]
    assert not any(name.startswith('late') for name in lines[0])


def test_nothing_is_left_of_a_run_without_a_frame(tmp_path):
    for begin in (lambda: RunFolder(tmp_path / 'runs', 'x', None, STARTED),
                  lambda: RunFolder(tmp_path / 'runs', 'x', Settings(), STARTED)):
        with pytest.raises((KeyboardInterrupt, TypeError)), begin() as folder:
            folder.write_ground_truth(Trajectory(np.array([5, 6]), np.tile(np.eye(4), (2, 1, 1))))
            raise KeyboardInterrupt
    assert os.listdir(tmp_path) == []


def test_a_frame_for_which_the_disk_has_no_room_is_in_neither_file(tmp_path, monkeypatch):
    def fail(lines):
        raise InputError('no room')

    with RunFolder(tmp_path, 'x', Settings(), STARTED) as folder:
        folder.add(record(1))
        for growing in (folder._frames, folder._trajectory):
            with pytest.raises(InputError, match='no room'), monkeypatch.context() as patch:
                patch.setattr(growing, 'append', fail)
                folder.add(record(2))
        folder.add(record(3))
    assert read_trajectory(folder.path / 'trajectory.tum').poses[:, 0, 3].tolist() == [1, 3]
    with open(folder.path / 'frames.csv', newline='') as file:
        assert [float(line['stamp']) for line in csv.DictReader(file)] == [1, 3]


def test_settings_summary_and_ground_truth_have_files_of_their_own(tmp_path):
    settings = with_values(Settings(), {'aick.iterations': 7})
    truth = Trajectory(np.array([5, 6]) * NANOSECONDS, np.tile(np.eye(4), (2, 1, 1)))
    with RunFolder(tmp_path, 'a room', settings, STARTED) as folder:
        folder.add(record(1))
        folder.write_summary(SimpleNamespace(to_json=lambda: {'frames': 2}))
        folder.write_ground_truth(truth)
    text = (folder.path / 'settings.yaml').read_text()
    assert 'Settings of the run over a room, 2026-01-02 03:04.' in text.splitlines()[0]
    assert 'iterations: 7' in text
    assert json.loads((folder.path / 'summary.json').read_text()) == {'frames': 2}
    assert read_trajectory(folder.path / 'ground_truth.tum').stamps.tolist() == \
        truth.stamps.tolist()
    assert os.readlink(tmp_path / 'latest') == folder.path.name


def test_a_folder_is_named_after_source_and_time_and_never_used_twice(tmp_path):
    names = [make_folder(tmp_path / 'runs', 'a b/c_1.2-d:e', STARTED).name for _ in range(3)]
    assert names == [f'a_b_c_1.2-d_e-20260102-030405{end}' for end in ('', '-2', '-3')]


def test_a_place_for_no_folder_is_named(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(InputError, match=f'cannot make the folder {tmp_path}/file/x-.*: Not a d'):
        make_folder(tmp_path / 'file', 'x', STARTED)
    (tmp_path / 'x-20260102-030405').touch()
    with pytest.raises(InputError, match='x-20260102-030405: File exists'):
        make_folder(tmp_path, 'x', STARTED)


def test_a_file_named_latest_stays(tmp_path):
    (tmp_path / 'latest').write_text('mine')
    link_latest(make_folder(tmp_path, 'x', STARTED))
    assert (tmp_path / 'latest').read_text() == 'mine'
    assert len(os.listdir(tmp_path)) == 2
