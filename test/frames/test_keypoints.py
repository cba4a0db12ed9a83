# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints against the scene that was rendered, and the detector they come from."""

import dataclasses
from contextlib import nullcontext

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features import make_detector
from aick_ros.features.detector import Features
from aick_ros.features.vocabulary import Vocabulary
from aick_ros.frames import depth
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame, required_pair
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.settings import FeatureSettings, SensorSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
COLOUR = np.zeros((480, 640, 3), np.uint8)
DEPTH = np.ones((480, 640), np.float32)


@pytest.fixture(scope='module')
def rendered():
    return SyntheticSource(SyntheticOptions.perfect(seed=3, frames=20))


def extract(frame, **features):
    return KeypointExtractor(FeatureSettings(**features), SensorSettings()).extract(frame)


def test_keypoints_lie_on_the_rendered_scene(rendered):
    """The depth of a keypoint is between those rendered at the four pixels around it."""
    frame = rendered.frame(0)
    keypoints = extract(frame)
    assert len(keypoints) > 300
    np.testing.assert_allclose(frame.camera.project(keypoints.positions), keypoints.pixels,
                               atol=1e-3)
    column, row = np.floor(keypoints.pixels).astype(int).T
    around = np.stack([frame.depth[np.clip(row + i, 0, 479), np.clip(column + j, 0, 639)]
                       for i in (0, 1) for j in (0, 1)])
    assert np.all(keypoints.positions[:, 2] >= np.nanmin(around, axis=0) - 1e-5)
    assert np.all(keypoints.positions[:, 2] <= np.nanmax(around, axis=0) + 1e-5)


def responses(frame):
    """Return the responses of all keypoints with depth by descriptor and position, in order."""
    found = make_detector(FeatureSettings()).detect(frame.grey)
    valid = np.isfinite(depth.sample(frame.depth, found.pixels, SensorSettings()))
    return {(tuple(pixel), bytes(descriptor)): response for pixel, descriptor, response in zip(
        found.pixels[valid].tolist(), found.descriptors[valid], found.responses[valid])}


def test_the_strongest_of_the_image_are_kept_strongest_first(rendered):
    frame = rendered.frame(0)
    all_responses = responses(frame)
    kept = extract(frame, max_keypoints=100, cell_size=0.0)
    found = [all_responses[tuple(pixel), bytes(descriptor)]
             for pixel, descriptor in zip(kept.pixels.tolist(), kept.descriptors)]
    assert len(all_responses) > 300
    assert found == sorted(all_responses.values(), reverse=True)[:100]


def test_the_strongest_of_each_cell_are_kept_strongest_first(rendered):
    frame = rendered.frame(0)
    strongest = {}
    for (pixel, _), response in responses(frame).items():
        cell = pixel[0] // 60, pixel[1] // 60
        strongest[cell] = max(strongest.get(cell, 0), response)
    kept = extract(frame, max_keypoints=len(strongest), cell_size=60.0)
    assert len(strongest) > 50
    assert {(u // 60, v // 60) for u, v in kept.pixels.tolist()} == set(strongest)
    found = [responses(frame)[tuple(pixel), bytes(descriptor)]
             for pixel, descriptor in zip(kept.pixels.tolist(), kept.descriptors)]
    assert found == sorted(strongest.values(), reverse=True)


@pytest.mark.parametrize('chosen', [
    slice(20), slice(0), slice(10_000), np.array([7, 3, 99]), np.arange(100) % 2 == 0])
def test_some_keypoints_of_a_frame_are_rows_of_all_its_arrays_without_words(rendered, chosen):
    words = Vocabulary('orb', np.random.default_rng(0).integers(0, 256, (30, 32), np.uint8))
    keypoints = KeypointExtractor(FeatureSettings(max_keypoints=100), SensorSettings(), words,
                                  0.5).extract(rendered.frame(0))
    found = keypoints[chosen]
    assert len(keypoints) == 100 and keypoints.words is not None
    assert len(found) == len(np.arange(100)[chosen])
    assert found.words is None and found.stamp == keypoints.stamp
    for name in ('positions', 'descriptors', 'covariances', 'pixels'):
        np.testing.assert_array_equal(getattr(found, name), getattr(keypoints, name)[chosen])


def test_types_are_those_declared(rendered):
    keypoints = extract(rendered.frame(0))
    assert keypoints.descriptors.dtype == np.uint8
    assert keypoints.positions.dtype == keypoints.covariances.dtype == np.float32
    assert keypoints.pixels.dtype == np.float32


def test_covariances_are_positive_and_follow_the_depth_noise(rendered):
    keypoints = extract(rendered.frame(0))
    assert keypoints.covariances.shape == (len(keypoints), 3, 3)
    assert np.all(np.linalg.eigvalsh(keypoints.covariances.astype(float)) > 0)
    along_z = np.sqrt(keypoints.covariances[:, 2, 2])
    np.testing.assert_allclose(
        along_z, SensorSettings().depth_sigma * keypoints.positions[:, 2] ** 2, rtol=1e-3)


def test_grey_images_give_the_same_keypoints(rendered):
    frame = rendered.frame(0)
    grey = dataclasses.replace(frame, colour=frame.grey)
    np.testing.assert_array_equal(extract(grey).pixels, extract(frame).pixels)


@pytest.mark.parametrize('changes', [
    {'colour': COLOUR}, {'depth': np.full_like(DEPTH, np.nan)},
    {'colour': COLOUR, 'depth': np.full_like(DEPTH, np.nan)}], ids=['black', 'no depth', 'both'])
def test_without_texture_or_depth_there_are_no_keypoints(rendered, changes):
    keypoints = extract(dataclasses.replace(rendered.frame(0), **changes))
    assert len(keypoints) == 0
    assert keypoints.positions.shape == (0, 3)
    assert keypoints.covariances.shape == (0, 3, 3)
    assert keypoints.descriptors.shape[0] == 0


def test_a_frame_without_keypoints_is_like_one_in_which_none_are_found(rendered):
    black = dataclasses.replace(rendered.frame(0), stamp=5, colour=COLOUR)
    found, none = extract(black), KeypointFrame.none(5)
    assert len(none) == 0
    for field in dataclasses.fields(KeypointFrame):
        mine, theirs = getattr(none, field.name), getattr(found, field.name)
        if isinstance(theirs, np.ndarray):
            assert (mine.shape, mine.dtype) == (theirs.shape, theirs.dtype)
        else:
            assert mine == theirs


@pytest.mark.parametrize('side, is_enough', [(7, False), (8, True)])
def test_the_smallest_level_of_the_pyramid_has_two_pixels(side, is_enough):
    """Three levels, each of half the size of the one before."""
    orb = dataclasses.replace(FeatureSettings().orb, scale_factor=2.0, levels=3)
    detector = make_detector(dataclasses.replace(FeatureSettings(), orb=orb))
    for shape in ((side, 40), (40, side)):
        with nullcontext() if is_enough else pytest.raises(InputError, match='too small for'):
            detector.detect(np.zeros(shape, np.uint8))


def test_keypoints_without_a_ray_are_dropped(rendered):
    frame = rendered.frame(0)
    wide = dataclasses.replace(frame, camera=Camera(640, 480, 150, 150, 320, 240, 'equidistant',
                                                    (0.02, -0.01, 0.003, -0.001)))
    keypoints = extract(wide)
    assert 0 < len(keypoints)
    assert np.isfinite(keypoints.positions).all()
    assert np.hypot(*(keypoints.pixels - (320, 240)).T).max() < 150 * np.pi / 2


@pytest.mark.parametrize('size', [(1, 1), (1, 640), (3, 3)])
def test_an_image_too_small_for_the_pyramid_is_rejected(size):
    frame = RgbdFrame(0, np.zeros(size, np.uint8), np.ones(size, np.float32),
                      dataclasses.replace(CAMERA, width=size[1], height=size[0]))
    with pytest.raises(InputError, match='too small for the pyramid'):
        extract(frame)


class AtTheCentre:
    """A detector of three keypoints at the principal point, of three scales."""

    def detect(self, grey):
        return Features(np.full((3, 2), (320.0, 240.0), np.float32), np.zeros((3, 32), np.uint8),
                        np.array([3.0, 2.0, 1.0], np.float32),
                        np.array([1.0, 2.0, 4.0], np.float32))


def test_the_noise_of_a_keypoint_grows_with_a_power_of_its_scale():
    """Across the optical axis it is sigma * scale^p * z / f, each axis with its focal length."""
    frame = RgbdFrame(0, COLOUR, 2.0 * DEPTH, Camera(640, 480, 500, 400, 320, 240))
    features = FeatureSettings()
    features = dataclasses.replace(features, orb=dataclasses.replace(
        features.orb, pixel_sigma=0.3, pixel_exponent=1.5))
    found = KeypointExtractor(features, SensorSettings(), detector=AtTheCentre()).extract(frame)
    sigmas = 0.3 * np.array([1.0, 2.0, 4.0]) ** 1.5
    np.testing.assert_allclose(found.covariances[:, 0, 0], (sigmas * 2 / 500) ** 2, rtol=1e-5)
    np.testing.assert_allclose(found.covariances[:, 1, 1], (sigmas * 2 / 400) ** 2, rtol=1e-5)


class At:
    """A detector of keypoints at given pixels, each with a response of its own."""

    def __init__(self, pixels):
        self._pixels = np.array(pixels, np.float32)

    def detect(self, grey):
        count = len(self._pixels)
        return Features(self._pixels, np.arange(32 * count, dtype=np.uint8).reshape(count, 32),
                        np.arange(count, 0, -1, dtype=np.float32), np.ones(count, np.float32))


@pytest.mark.parametrize('maximum, kept', [(0, 5), (4, 4), (5, 5), (6, 5)])
@pytest.mark.parametrize('cell_size', [0.0, 60.0])
def test_up_to_the_maximum_all_keypoints_are_kept_and_0_keeps_all(maximum, kept, cell_size):
    pixels = [(100 + i, 100) for i in range(5)]
    features = FeatureSettings(max_keypoints=maximum, cell_size=cell_size)
    frame = RgbdFrame(3, COLOUR, DEPTH, CAMERA)
    found = KeypointExtractor(features, SensorSettings(), detector=At(pixels)).extract(frame)
    np.testing.assert_array_equal(found.pixels, pixels[:kept])
    assert found.stamp == 3


def test_keypoints_without_depth_take_no_place_of_others():
    holes = DEPTH.copy()
    holes[:, :320] = np.nan
    pixels = [(100, 50), (400, 50), (120, 70), (420, 70)]
    features = FeatureSettings(max_keypoints=2, cell_size=0.0)
    found = KeypointExtractor(features, SensorSettings(), detector=At(pixels)).extract(
        RgbdFrame(0, COLOUR, holes, CAMERA))
    np.testing.assert_array_equal(found.pixels, [(400, 50), (420, 70)])


def test_arrays_that_are_kept_for_long_cannot_be_changed(rendered):
    keypoints = extract(rendered.frame(0))
    for name in ('positions', 'descriptors', 'covariances', 'pixels'):
        with pytest.raises(ValueError, match='read-only'):
            getattr(keypoints, name)[0] = 0


def test_words_are_those_of_the_vocabulary_within_the_radius():
    pixels = [(100, 50), (400, 50), (120, 70), (420, 70)]
    frame, vocabulary = RgbdFrame(0, COLOUR, DEPTH, CAMERA), Vocabulary(
        'orb', np.random.default_rng(0).integers(0, 256, (9, 32), np.uint8))
    for radius in (0.0, 0.5, np.inf):
        found = KeypointExtractor(FeatureSettings(), SensorSettings(), vocabulary, radius,
                                  At(pixels)).extract(frame)
        expected = vocabulary.words_of(found.descriptors, radius)
        np.testing.assert_array_equal(found.words.keypoints, expected.keypoints)
        np.testing.assert_array_equal(found.words.closest, expected.closest)
    assert KeypointExtractor(FeatureSettings(), SensorSettings(), detector=At(pixels)).extract(
        frame).words is None


def test_range_and_noise_of_the_sensor_are_those_of_its_settings():
    """Of columns at 1, 3 and 5 m those within the range count, each with its own noise."""
    depths = np.repeat(np.float32([[1.0, 3.0, 5.0]]), 200, axis=1) * np.ones((480, 1), np.float32)
    frame = RgbdFrame(0, COLOUR[:, :600].copy(), depths,
                      Camera(600, 480, 500, 500, 299.5, 239.5))
    sensor = SensorSettings(min_depth=2.0, max_depth=6.0, depth_sigma=0.01, depth_exponent=1.0)
    found = KeypointExtractor(FeatureSettings(), sensor, detector=At(
        [(100, 50), (300, 50), (500, 50)])).extract(frame)
    np.testing.assert_allclose(found.positions[:, 2], [3.0, 5.0])
    np.testing.assert_allclose(found.covariances[:, 2, 2], np.square([0.03, 0.05]), rtol=1e-5)


@pytest.mark.parametrize('changes, kinds', [
    ({'descriptors': np.ones((2, 64), np.uint8)}, '32 uint8 and 64 uint8'),
    ({'descriptors': np.ones((2, 32), np.float32)}, '32 uint8 and 32 float32')])
def test_the_descriptors_of_a_pair_are_of_one_kind(changes, kinds):
    def frame(count=2, **fields):
        return KeypointFrame(**{
            'stamp': 0, 'positions': np.ones((count, 3)), 'covariances': np.ones((count, 3, 3)),
            'descriptors': np.ones((count, 32), np.uint8), 'pixels': np.ones((count, 2)),
            **fields})
    with pytest.raises(InputError) as raised:
        required_pair(frame(), frame(**changes))
    assert str(raised.value) == (
        f'the descriptors are {kinds} per keypoint: those of one detector are required')
    required_pair(frame(), frame())
    required_pair(KeypointFrame.none(0), frame(**changes))
    required_pair(frame(**changes), KeypointFrame.none(0))
    for pair, name in (((None, frame()), 'source'), ((frame(), None), 'target')):
        with pytest.raises(InputError, match=f'the {name}: None'):
            required_pair(*pair)


def test_a_detector_must_return_features():
    class Nothing:
        def detect(self, grey):
            return None

    frame = RgbdFrame(1, np.zeros((48, 64), np.uint8), np.ones((48, 64), np.float32),
                      Camera(64, 48, 50.0, 50.0, 31.5, 23.5))
    with pytest.raises(InputError) as raised:
        KeypointExtractor(FeatureSettings(), SensorSettings(), detector=Nothing()).extract(frame)
    assert str(raised.value) == ('what the detector has returned: None, where an object of the '
                                 'class Features is required')
    with pytest.raises(InputError, match='^the detector: .* an object with the method detect is'):
        KeypointExtractor(FeatureSettings(), SensorSettings(), detector=object())


def test_descriptors_of_two_detectors_are_named():
    one = KeypointFrame.none(1)
    two, three = (KeypointFrame(1, np.ones((1, 3)), descriptors, np.ones((1, 3, 3)),
                                np.ones((1, 2))) for descriptors in (
        np.zeros((1, 32), np.uint8), np.zeros((1, 64), np.float32)))
    required_pair(one, three)  # without keypoints there is nothing to compare
    required_pair(two, two)
    with pytest.raises(InputError) as raised:
        required_pair(two, three)
    assert str(raised.value) == ('the descriptors are 32 uint8 and 64 float32 per keypoint: those '
                                 'of one detector are required')


def test_of_equally_strong_keypoints_the_first_one_detected_is_kept():
    pixels = [(40 + 5 * (i % 100), 40 + 5 * (i // 100)) for i in range(2000)]

    class Alike(At):
        def detect(self, grey):
            found = super().detect(grey)
            return dataclasses.replace(found, responses=np.repeat(np.float32([1, 2]), 1000))

    features = FeatureSettings(max_keypoints=1500, cell_size=0.0)
    found = KeypointExtractor(features, SensorSettings(), detector=Alike(pixels)).extract(
        RgbdFrame(0, COLOUR, DEPTH, CAMERA))
    np.testing.assert_array_equal(found.pixels, pixels[1000:] + pixels[:500])
