# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""TUM folders that are written: read back by OpenCV and by our own reader."""

import dataclasses
import os

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.writers.tum_writer import write_tum


def test_frames_come_back(tmp_path, recording, assert_same_frames):
    progress = []
    written = write_tum(tmp_path / 'out', recording,
                        progress=lambda *numbers: progress.append(numbers))
    assert written == 6
    assert progress == [(number, 6) for number in range(1, 7)]
    source = open_source(tmp_path / 'out')
    assert_same_frames(list(source.frames(raise_damage)), recording.recorded)
    assert np.array_equal(source.ground_truth.stamps, recording.ground_truth.stamps)
    assert np.allclose(source.ground_truth.poses, recording.ground_truth.poses, atol=2e-8)


def test_the_files_are_those_of_the_benchmark(tmp_path, recording):
    write_tum(tmp_path / 'out', recording)
    frame = recording.recorded[0]
    line = (tmp_path / 'out' / 'depth.txt').read_text().splitlines()[1]
    stamp, file = line.split()
    assert stamp == f'{frame.depth_stamp // 10**9}.{frame.depth_stamp % 10**9:09d}'
    units = cv2.imread(str(tmp_path / 'out' / file), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(units, np.nan_to_num(np.rint(frame.depth * 5000)).astype(np.uint16))
    truth = np.loadtxt(tmp_path / 'out' / 'groundtruth.txt')
    assert np.allclose(truth[:, 1:4], recording.ground_truth.poses[:, :3, 3], atol=1e-9)


def test_grey_and_missing_stamps_and_truth_are_no_hindrance(tmp_path, recording):
    frames = [dataclasses.replace(frame, colour=frame.colour[:, :, 0], depth_stamp=None)
              for frame in recording.recorded]
    write_tum(tmp_path / 'out', dataclasses.replace(recording, recorded=frames, ground_truth=None))
    source = open_source(tmp_path / 'out')
    assert source.ground_truth is None
    for frame, original in zip(source.frames(raise_damage), frames, strict=True):
        assert frame.depth_stamp == frame.stamp == original.stamp
        assert np.array_equal(frame.colour, original.colour)


def test_nothing_is_written_without_frames(tmp_path, recording):
    with pytest.raises(InputError, match='in memory has no frames to write'):
        write_tum(tmp_path / 'out', dataclasses.replace(recording, recorded=[]))
    assert os.listdir(tmp_path) == []


def test_real_frames_come_back(tmp_path, real_folder, assert_same_frames):
    source = open_source(real_folder)
    source._pairs = source._pairs[:10]
    write_tum(tmp_path / 'out', source)
    assert_same_frames(list(open_source(tmp_path / 'out').frames(raise_damage)),
                       list(source.frames(raise_damage)))
