# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of recordings by the benchmark of level starts, and recordings that have none."""

import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def level_start(load):
    return load(FOLDER / 'level_start.py')


def with_vertical(truth, x):
    """Return a path whose world is tilted by an angle about x [rad]."""
    return Trajectory(truth.stamps, se3.exp([0, 0, 0, x, 0, 0]) @ truth.poses)


def figures(row):
    """Return the first number of each cell but the name and whether the start was turned."""
    cells = row.strip('| ').split(' | ')
    return cells[2], [float(cell.split(',')[0]) for cell in cells[1:2] + cells[3:]]


def test_errors_are_those_to_the_vertical_of_the_ground_truth(level_start, tum_folder,
                                                              monkeypatch):
    frames, truth = level_start.frames_of(str(tum_folder('freiburg1_rpy_100')), 70)
    found = {}
    for tilt in (0.0, np.radians(30)):
        monkeypatch.setattr(level_start, 'frames_of',
                            lambda *_: (frames, with_vertical(truth, tilt)))
        found[tilt] = figures(level_start.row_of('a/recording'))
    (turned, straight), (_, tilted) = found.values()
    start, x, x_sigma, offset, offset_sigma, end, end_sigma = straight
    assert turned == 'no' and start < 10
    assert -0.16 < x < -0.05 and 0 < x_sigma < 0.09  # of a place that is 0.1 m uncertain at first
    assert -40 < offset < -5 and 0 < offset_sigma < 25
    assert end < 3 * end_sigma
    assert tilted[1:5] == straight[1:5]  # what is estimated does not know the ground truth
    assert abs(tilted[0] - 30) <= start + 0.1 and abs(tilted[5] - 30) <= end + 0.1


def test_a_recording_without_an_accelerometer_is_named(level_start, monkeypatch):
    source = SyntheticSource(SyntheticOptions(seed=5, frames=2))
    monkeypatch.setattr(level_start, 'frames_of',
                        lambda *_: (list(source.frames()), source.ground_truth))
    with pytest.raises(SystemExit, match='^a/recording has no accelerations that were used$'):
        level_start.row_of('a/recording')


@pytest.mark.parametrize('arguments, printed', [
    (['10', '1', '2'], ('rooms', 10, [1, 2])), (['2024'], ('recordings', ['2024'])),
    (['2024', 'desk'], ('recordings', ['2024', 'desk'])),
    (['nowhere'], ('recordings', ['nowhere'])), (['10'], None), ([], None)])
def test_a_folder_called_as_a_number_is_a_recording(level_start, tmp_path, monkeypatch, arguments,
                                                    printed):
    monkeypatch.chdir(tmp_path)
    for name in ('2024', 'desk'):
        (tmp_path / name).mkdir()
    found = []
    monkeypatch.setattr(level_start, 'print_rooms', lambda *of: found.append(('rooms', *of)))
    monkeypatch.setattr(level_start, 'print_recordings',
                        lambda *of: found.append(('recordings', *of)))
    monkeypatch.setattr(sys, 'argv', ['level_start.py', *arguments])
    with nullcontext() if printed else pytest.raises(SystemExit, match='FRAMES SEED'):
        level_start.main()
    assert found == ([printed] if printed else [])


def test_a_folder_that_is_no_recording_is_named(level_start, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['level_start.py', str(tmp_path / 'nowhere')])
    with pytest.raises(SystemExit, match='nowhere does not exist: a source is a ROS 2 bag'):
        level_start.main()


def test_a_frame_that_motion_capture_has_missed_is_named(level_start):
    truth = Trajectory(np.array([0, 10]), np.array([np.eye(4), np.eye(4)]))
    assert np.array_equal(level_start.pose_at(truth, 5), np.eye(4))
    with pytest.raises(SystemExit, match='does not cover 11 ns'):
        level_start.pose_at(truth, 11)
