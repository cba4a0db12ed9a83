# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames of the cameras that benchmarks name, and one sentence where there are none."""

import itertools
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def weights(load):
    return load(FOLDER / 'weights.py')


@pytest.fixture
def folder(tmp_path):
    source = SyntheticSource(SyntheticOptions(seed=5, frames=3))
    write_tum(tmp_path / 'desk', source)
    return tmp_path / 'desk'


def test_frames_are_the_first_ones_of_the_recording(weights, folder):
    frames, truth = weights.frames_of(str(folder), 2)
    source = SyntheticSource(SyntheticOptions(seed=5, frames=3))
    for frame, written in itertools.zip_longest(frames, itertools.islice(source.frames(), 2)):
        np.testing.assert_array_equal(frame.colour, written.colour)
    assert len(truth.stamps) == 3


def test_a_kind_of_camera_with_a_seed_is_rendered(weights):
    frames, truth = weights.frames_of('stereo:4', 2)
    assert len(frames) == 2 and truth.stamps[0] == frames[0].stamp


@pytest.mark.parametrize('camera', ['nowhere', 'kinect:desk', 'kinect'])
def test_what_is_no_camera_is_named(weights, camera):
    with pytest.raises(SystemExit, match=f'^{camera} does not exist: a source is'):
        weights.frames_of(camera, 2)


def test_a_folder_of_something_else_is_named(weights, tmp_path):
    with pytest.raises(SystemExit, match=str(tmp_path)):
        weights.frames_of(str(tmp_path), 2)


def test_a_recording_without_ground_truth_is_named(weights, folder):
    (folder / 'groundtruth.txt').unlink()
    with pytest.raises(SystemExit, match='desk has no ground truth$'):
        weights.frames_of(str(folder), 2)


def test_a_recording_without_frames_is_named(weights, monkeypatch):
    truth = SyntheticSource(SyntheticOptions(seed=5, frames=3)).ground_truth
    empty = SimpleNamespace(ground_truth=truth, frames=lambda on_damaged: iter(()))
    monkeypatch.setattr(weights, 'open_source', lambda recording: empty)
    with pytest.raises(SystemExit, match='^desk has no usable frame$'):
        weights.frames_of('desk', 2)


def test_a_damaged_image_is_named(weights, folder):
    image = sorted((folder / 'rgb').iterdir())[1]
    image.write_bytes(image.read_bytes()[:100])
    with pytest.raises(SystemExit, match=image.name):
        weights.frames_of(str(folder), 2)
