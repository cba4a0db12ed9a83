# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings that a benchmark can use, and the choice of their frame pairs."""

import dataclasses
import pickle
from itertools import islice
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.baselines.registry import METHODS, make
from aick_ros.evaluation.benchmark import recording as module
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.geometry import se3
from aick_ros.sources import SourceOptions, open_source, raise_damage


def scan(request, limit, on_progress=lambda done: None):
    return Recording.scan(dataclasses.replace(request, limit=limit), on_progress, raise_damage)


def test_a_recording_of_a_single_frame_has_no_pair(recording):
    seen = []
    assert scan(recording.request, 2, seen.append).stamps == recording.stamps[:2]
    assert seen == [1, 2]
    with pytest.raises(InputError, match='rendered has 1 usable frames: at least 2 are required'):
        scan(recording.request, 1)


def test_a_limited_number_of_pairs_is_evenly_spaced(recording):
    pairs = recording.pairs((1, 3), most=3)
    assert [pair.target for pair in pairs if pair.gap == 1] == [0, 3, 6]
    assert [pair.target for pair in pairs if pair.gap == 3] == [0, 2, 4]
    every = [FramePair(i, i + gap) for gap in (1, 3) for i in range(8 - gap)]
    assert recording.pairs((1, 3)) == recording.pairs((1, 3), most=7) == every


def test_a_recording_has_the_stamps_and_the_truth_of_its_source(recording, tum_path):
    source = open_source(tum_path)
    stamps = tuple(frame.stamp for frame in source.frames(raise_damage))
    assert (recording.name, recording.stamps) == (source.name, stamps)
    assert recording.request == Request(str(tum_path))
    np.testing.assert_array_equal(recording.ground_truth.poses, source.ground_truth.poses)
    assert recording.period == np.median(np.diff(stamps))


def test_the_error_is_that_of_the_motion_from_source_to_target(recording):
    """By a transform after the true one: of 30 mm, and of 20 mrad."""
    pair, off = FramePair(1, 4), se3.exp([0.0, 0.018, 0.024, 0.0, 0.0, 0.02])
    poses = [recording.ground_truth.at(recording.stamps[i]) for i in pair]
    motion = np.linalg.inv(poses[0]) @ poses[1]
    assert recording.error(pair, motion) == pytest.approx((0.0, 0.0), abs=1e-6)
    translation, rotation = recording.error(pair, motion @ off)
    assert translation == pytest.approx(np.linalg.norm(off[:3, 3]))
    assert rotation == pytest.approx(0.02)


@pytest.fixture
def mask(tmp_path):
    image = np.full((240, 320), 255, np.uint8)
    image[150:, 100:260] = 0
    cv2.imwrite(str(tmp_path / 'mask.png'), image)
    return str(tmp_path / 'mask.png')


@pytest.mark.parametrize('name', METHODS)
def test_what_is_masked_makes_no_difference_to_any_method(recording, mask, name):
    method = METHODS[name]
    if method.missing:
        pytest.skip(f'{name} is not installed')
    masked = scan(dataclasses.replace(recording.request, mask=mask), 3)
    frames = list(islice(recording.request.open().frames(raise_damage), 0, 3, 2))
    rng, part = np.random.default_rng(1), np.s_[150:, 100:260]
    body = rng.integers(0, 256, (90, 160, 3), np.uint8)
    covered = []
    for frame in frames:
        colour, depth = frame.colour.copy(), frame.depth.copy()
        colour[part], depth[part] = body, 0.6
        covered.append(dataclasses.replace(frame, colour=colour, depth=depth))

    def estimate(seen):
        registering = make(method.factory, method.options)
        target, source = map(registering.prepare, seen)
        return registering.register(source, target).T_target_source
    found, expected = (estimate(map(masked.shown, seen)) for seen in (covered, frames))
    np.testing.assert_array_equal(found, expected)
    assert not np.array_equal(estimate(frames), expected)


def test_a_mask_that_cannot_be_used_is_said_before_the_run(recording, mask, tmp_path):
    request = dataclasses.replace(recording.request, mask=str(tmp_path / 'none.png'))
    with pytest.raises(InputError, match=(
            r'\(--mask\) .*none.png: No such file or directory; name a PNG file')):
        scan(request, 2)
    cv2.imwrite(mask, np.full((100, 100), 255, np.uint8))
    with pytest.raises(InputError, match=(
            r'\(--mask\) has 100 x 100 pixels and the images 320 x 240')):
        scan(dataclasses.replace(request, mask=mask), 2)


def test_a_pair_without_truth_has_no_error(recording):
    blind = dataclasses.replace(recording, stamps=tuple(
        stamp + 10 ** 12 for stamp in recording.stamps))
    with pytest.raises(ValueError, match='the ground truth of rendered does not cover FramePair'):
        blind.error(FramePair(0, 1), np.eye(4))


def test_without_truth_there_is_no_recording(monkeypatch):
    blind = SimpleNamespace(name='desk', ground_truth=None)
    monkeypatch.setattr(Request, 'open', lambda self: blind)
    with pytest.raises(InputError, match='^desk has no ground truth, which a benchmark requires: '
                       'remove it from the command$'):
        Recording.scan(Request('desk'), print, raise_damage)


def test_damage_is_reported_by_the_scan(recording, monkeypatch):
    def frames(on_damaged):
        on_damaged(InputError('torn'))
        yield from (SimpleNamespace(stamp=i) for i in range(3))
    damaged = []
    monkeypatch.setattr(Request, 'open', lambda self: SimpleNamespace(
        name='desk', ground_truth=recording.ground_truth, frames=frames))
    assert Recording.scan(Request('desk'), lambda done: None, damaged.append).stamps == (0, 1, 2)
    assert [str(error) for error in damaged] == ['torn']


def test_a_recording_is_found_by_workers_in_other_folders(recording, tum_path, tmp_path,
                                                          monkeypatch):
    monkeypatch.chdir(tum_path.parent)
    here = scan(Request(tum_path.name), 2)
    monkeypatch.chdir(tmp_path)
    stamps = [frame.stamp for frame in islice(here.request.open().frames(raise_damage), 2)]
    assert here.stamps == tuple(stamps) == recording.stamps[:2]


@pytest.mark.parametrize('path', ['synthetic', 'synthetic:3'])
def test_what_is_rendered_is_in_no_folder(path):
    request = Request(path)
    assert request.with_absolute_path() == request


def test_a_request_opens_what_it_was_made_of_and_is_sent_to_others(monkeypatch):
    opened = []
    monkeypatch.setattr(module, 'open_source', lambda *asked: opened.append(asked))
    request = pickle.loads(pickle.dumps(Request('a', 5, 0.07)))
    request.open()
    assert request == Request('a', 5, 0.07)
    assert opened == [('a', SourceOptions(max_interval=0.07))]


def test_a_request_registers_depth(monkeypatch):
    opened, pose = [], (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0)
    monkeypatch.setattr(module, 'open_source', lambda *asked: opened.append(asked))
    request = Request('a', None, 0.07, True, '/info', pose)
    pickle.loads(pickle.dumps(request)).open()
    assert opened == [('a', SourceOptions(max_interval=0.07, register_depth=True,
                                          depth_info_topic='/info', depth_in_colour=pose))]
