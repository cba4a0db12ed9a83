# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Preparation of frames: by which settings, once each, and on several threads at once."""

import dataclasses
import itertools
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.mask import MaskedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.registration import stage_times
from aick_ros.registration.preparation import Preparation, Preparer
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def frames():
    """Return frames of chequered noise on a slope."""
    rng = np.random.default_rng(1)
    depth = np.broadcast_to(np.linspace(1.0, 2.0, 320, dtype=np.float32), (240, 320)).copy()
    return [RgbdFrame(stamp, np.kron(rng.integers(0, 256, (24, 32), np.uint8),
                                     np.ones((10, 10), np.uint8)), depth, CAMERA)
            for stamp in range(4)]


@pytest.mark.parametrize('detector', ['orb', 'surf', 'sift'])
def test_threads_that_share_a_preparer_do_not_disturb_each_other(frames, detector):
    preparer = Preparer(with_values(Settings(), {'features.detector': detector}))
    alone = [preparer.prepare(frame) for frame in frames]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(preparer.prepare, 3 * frames))
    for one, other in zip(3 * alone, together, strict=True):
        np.testing.assert_array_equal(one.keypoints().positions, other.keypoints().positions)
        np.testing.assert_array_equal(one.keypoints().descriptors, other.keypoints().descriptors)
        np.testing.assert_array_equal(one.surface().points, other.surface().points)
        np.testing.assert_array_equal(one.surface().chosen, other.surface().chosen)


def test_each_part_is_made_once(frames):
    preparation = Preparer(Settings()).begin(frames[0])
    assert preparation.keypoints() is preparation.keypoints()
    assert preparation.surface() is preparation.surface()


def test_without_depth_in_the_refinement_there_is_no_surface(frames):
    preparer = Preparer(with_values(Settings(), {'refinement.mode': 'keypoints'}))
    assert preparer.prepare(frames[0]).surface() is None


VALUES = {'aick.word_radius': 0.17, 'refinement.surface_points': 321, 'sensor.max_depth': 3.5}


def noted(monkeypatch, name, answer):
    """Let a name of the module answer, and return the list of what it is given."""
    given = []
    monkeypatch.setattr(f'aick_ros.registration.preparation.{name}',
                        lambda *args: given.append(args) or answer)
    return given


@pytest.mark.parametrize('interval, is_due', [(1, True), (2, False)])
def test_what_is_prepared_ahead_is_what_each_frame_needs(frames, monkeypatch, interval, is_due):
    """Keypoints where AICK registers every frame; both parts by the settings."""
    settings = with_values(Settings(), {**VALUES, 'odometry.aick_interval': interval})
    extracted = []
    extractor = SimpleNamespace(extract=lambda frame: extracted.append(frame) or 'keypoints')
    made = noted(monkeypatch, 'KeypointExtractor', extractor)
    vocabularies = noted(monkeypatch, 'vocabulary_of', 'words')
    surfaces = noted(monkeypatch, 'Surface.of', 'a surface')
    detector = object()
    preparation = Preparer(settings, detector).prepare(frames[0])
    assert made == [(settings.features, settings.sensor, 'words', 0.17, detector)]
    assert vocabularies == [(settings,)]
    frame = preparation.frame
    assert extracted == ([frame] if is_due else [])
    assert surfaces == [(frame.depth, frame.camera, settings.sensor, 321)]
    assert (preparation.surface(), preparation.keypoints()) == ('a surface', 'keypoints')
    assert extracted == [frame] and len(surfaces) == 1


def test_keypoints_and_surface_are_made_of_the_frame_masked_once(frames, monkeypatch):
    settings = with_values(Settings(), {'sensor.roi_ratios': (0.0, 0.25, 0.0, 0.0)})
    extracted = []
    made = noted(monkeypatch, 'KeypointExtractor', SimpleNamespace(extract=extracted.append))
    surfaces = noted(monkeypatch, 'Surface.of', 'a surface')
    preparation = Preparer(settings).prepare(frames[0])
    [masked] = extracted
    assert isinstance(masked, MaskedFrame) and masked is preparation.corrected()
    assert np.isnan(masked.depth[:, 240:]).all() and np.isfinite(masked.depth[:, :240]).all()
    [(_, sensor, *_)], [(depth, *_)] = made, surfaces
    assert sensor == Settings().sensor and depth is masked.depth
    assert not np.isnan(preparation.frame.depth).any()


def test_each_part_has_its_time(frames, monkeypatch):
    monkeypatch.setattr(stage_times, 'clock', map(float, itertools.count()).__next__)
    preparation = Preparer(Settings()).begin(frames[0])
    preparation.surface()
    assert preparation.times.take() == {'features': 0.0, 'surface': 1000.0, 'registration': 0.0,
                                        'refinement': 0.0, 'total': 1000.0}
    for _ in range(2):
        preparation.keypoints()
    assert preparation.times.take() == {'features': 1000.0, 'surface': 0.0, 'registration': 0.0,
                                        'refinement': 0.0, 'total': 1000.0}


def test_samples_of_an_imu_may_come_after_the_images(frames):
    preparer = Preparer(Settings())
    preparation = preparer.begin(frames[0])
    assert preparation.frame.imu is None and preparation.preparer is preparer
    colour = preparation.frame.colour
    samples = ImuSamples(np.array([1, 2]), np.ones((2, 3)), np.zeros((2, 3)))
    preparation.add_imu(samples)
    assert preparation.frame.imu is samples and preparation.frame.colour is colour


def test_images_are_copied_before_anything_is_made_of_them(frames):
    colour = frames[0].colour.copy()
    frame = dataclasses.replace(frames[0], colour=colour)
    preparation = Preparer(Settings()).begin(frame)
    colour[:] = 0
    np.testing.assert_array_equal(preparation.frame.colour, frames[0].colour)


@pytest.mark.parametrize('make', [
    lambda frame, preparer: Preparer(None), lambda frame, preparer: preparer.begin('frame'),
    lambda frame, preparer: preparer.prepare(None), lambda frame, preparer: Preparation(
        None, preparer), lambda frame, preparer: Preparation(frame, None),
    lambda frame, preparer: preparer.begin(frame).add_imu([1, 2])])
def test_arguments_of_another_kind_are_rejected(frames, make):
    with pytest.raises(InputError):
        make(frames[0], Preparer(Settings()))


def test_what_is_prepared_is_made_again_only_where_another_distortion_is_known(frames):
    preparer = Preparer(Settings())
    before = preparer.prepare(frames[0])
    assert before.up_to_date() is before
    preparer.distortion = DepthDistortion(np.full((ROWS, COLUMNS), 0.1))
    preparation = before.up_to_date()
    assert preparation is not before and preparation.up_to_date() is preparation
    assert preparation.times is before.times
    assert preparation.frame is before.frame and preparation.distortion is preparer.distortion
    kept = preparation.keypoints().pixels
    np.testing.assert_array_equal(kept, before.keypoints().pixels)
    for one, other in ((preparation.keypoints().positions, before.keypoints().positions),
                       (preparation.surface().points, before.surface().points)):
        inverse, usual = 1 / one[:, 2].astype(float), 1 / other[:, 2].astype(float)
        valid = np.isfinite(usual)
        np.testing.assert_allclose(inverse[valid], usual[valid] + 0.1, rtol=1e-5)


def test_a_frame_that_begins_has_the_distortion_known_by_then(frames):
    preparer = Preparer(Settings())
    preparer.distortion = DepthDistortion(np.full((ROWS, COLUMNS), 0.1))
    preparation = preparer.begin(frames[0])
    corrected = preparation.corrected()
    assert corrected is preparation.corrected() is preparation.corrected_for(preparer.distortion)
    np.testing.assert_allclose(1 / corrected.depth, 1 / frames[0].depth + 0.1, rtol=1e-5)
    other = preparation.corrected_for(DepthDistortion(np.full((ROWS, COLUMNS), 0.2)))
    np.testing.assert_allclose(1 / other.depth, 1 / frames[0].depth + 0.2, rtol=1e-5)
    assert preparation.corrected_for(NO_DISTORTION) is preparation.frame
    assert preparation.corrected() is corrected
    again = preparer.begin(frames[0])
    assert again.corrected_for(preparer.distortion) is again.corrected()  # made once
    undistorted = Preparer(Settings()).begin(frames[0])
    assert undistorted.corrected() is undistorted.frame
