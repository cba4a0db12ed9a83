# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The contract of all detectors, and their repeatability under known image changes."""

import dataclasses
import pickle

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features import make_detector
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.features.haar import describe
from aick_ros.features.hessian import find_blobs
from aick_ros.settings import FeatureSettings, Settings
from aick_ros.settings.parameter import parameters
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

DETECTORS = next(p for p in parameters(Settings) if p.name == 'features.detector').choices
STRONGEST = 300


@pytest.fixture(scope='module')
def grey():
    return SyntheticSource(SyntheticOptions(seed=3, frames=1)).frame(0).grey


def detector(name):
    return make_detector(FeatureSettings(detector=name))


def share_matched(name, before, after, scale=1.0, shift=(0, 0)):
    """Return the fraction of the strongest keypoints whose nearest descriptor is within 2 px."""
    found = [detector(name).detect(image) for image in (before, after)]
    pixels, descriptors = zip(*(
        (features.pixels[best], features.descriptors[best]) for features in found
        for best in [np.argsort(-features.responses)[:STRONGEST]]))
    moved = scale * pixels[0] + np.float32(shift)
    inside = ((moved > 20) & (moved < np.float32(after.shape[::-1]) - 20)).all(axis=1)
    nearest = descriptor_distances(*descriptors).argmin(axis=1)
    return np.mean(np.linalg.norm(moved - pixels[1][nearest], axis=1)[inside] < 2.0)


@pytest.mark.parametrize('name', DETECTORS)
def test_features_have_the_declared_types_and_ranges(name, grey):
    features = detector(name).detect(grey)
    count = len(features.pixels)
    assert count > 300
    assert features.pixels.shape == (count, 2)
    assert features.responses.shape == features.scales.shape == (count,)
    assert len(features.descriptors) == count
    assert features.descriptors.dtype in (np.uint8, np.float32)
    assert features.pixels.dtype == features.responses.dtype == features.scales.dtype == np.float32
    assert features.scales.min() < 1.1
    assert np.all(features.pixels >= 0)
    assert np.all(features.pixels <= np.float32(grey.shape[::-1]) - 1)
    if features.descriptors.dtype == np.float32:
        np.testing.assert_allclose(np.linalg.norm(features.descriptors, axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize('name', DETECTORS)
def test_an_image_without_texture_has_no_keypoints(name, grey):
    nothing, something = (detector(name).detect(image) for image in (np.zeros_like(grey), grey))
    assert nothing.pixels.shape == (0, 2)
    assert nothing.descriptors.shape == (0, something.descriptors.shape[1])
    assert nothing.descriptors.dtype == something.descriptors.dtype
    assert nothing.responses.shape == nothing.scales.shape == (0,)


@pytest.mark.parametrize('name', DETECTORS)
def test_the_same_image_gives_the_same_features(name, grey):
    first, second = detector(name).detect(grey), detector(name).detect(grey.copy())
    np.testing.assert_array_equal(first.pixels, second.pixels)
    np.testing.assert_array_equal(first.descriptors, second.descriptors)


@pytest.mark.parametrize('alpha, beta', [(0.7, 10), (0.5, 0), (0.8, 50)])
def test_surf_matches_dimmed_keypoints_as_well_as_orb(grey, alpha, beta):
    dimmed = cv2.convertScaleAbs(grey, alpha=alpha, beta=beta)
    surf, orb = (share_matched(name, grey, dimmed) for name in ('surf', 'orb'))
    assert surf > 0.95
    assert surf >= orb - 0.01


@pytest.mark.parametrize('shift', [(8, -6), (-16, 4), (7.5, -5.3)])
def test_surf_matches_shifted_keypoints_as_well_as_orb(grey, shift):
    moved = cv2.warpAffine(grey, np.float32([[1, 0, shift[0]], [0, 1, shift[1]]]),
                           grey.shape[::-1])
    surf, orb = (share_matched(name, grey, moved, shift=shift) for name in ('surf', 'orb'))
    assert surf > 0.7
    assert surf >= orb


@pytest.mark.parametrize('scale', [0.8, 0.9, 1.1, 1.25])
def test_surf_matches_scaled_keypoints_nearly_as_well_as_orb(grey, scale):
    scaled = cv2.resize(grey, None, fx=scale, fy=scale,
                        interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    shift = 0.5 * (scale - 1)  # the origin is the centre of the first pixel
    surf, orb = (share_matched(name, grey, scaled, scale, (shift, shift))
                 for name in ('surf', 'orb'))
    assert surf > 0.5
    assert surf > orb - 0.1


@pytest.mark.parametrize('scale', [1.25, 1.5])
def test_surf_keypoints_scale_in_position_and_size(grey, scale):
    """Enlarged only: in smaller images the smallest keypoints are missing."""
    scaled = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    before, after = (detector('surf').detect(image) for image in (grey, scaled))
    best = np.argsort(-before.responses)[:STRONGEST]
    moved = scale * before.pixels[best] + 0.5 * (scale - 1)
    size = scale * before.scales[best]
    distances = np.linalg.norm(moved[:, None] - after.pixels, axis=2)
    nearest = distances.argmin(axis=1)
    assert np.mean(distances.min(axis=1) < 2.0 * size) > 0.9
    found = distances.min(axis=1) < 1.0
    np.testing.assert_allclose(
        np.median((after.pixels[nearest] - moved)[found], axis=0), 0.0, atol=0.1)
    assert np.median((after.scales[nearest] / size)[found]) == pytest.approx(1.0, abs=0.06)


def used(detector):
    """Return the object of OpenCV that a detector uses."""
    return next(value for value in vars(detector).values() if isinstance(value, cv2.Feature2D))


@pytest.mark.parametrize('name, changes, getters', [
    ('sift', {'nfeatures': 321, 'octave_layers': 4, 'contrast_threshold': 0.05,
              'edge_threshold': 7.0, 'sigma': 1.9},
     {'nfeatures': 'NFeatures', 'octave_layers': 'NOctaveLayers',
      'contrast_threshold': 'ContrastThreshold', 'edge_threshold': 'EdgeThreshold',
      'sigma': 'Sigma'})])
def test_opencv_has_the_settings(name, changes, getters):
    group = dataclasses.replace(getattr(FeatureSettings(), name), **changes)
    made = make_detector(dataclasses.replace(FeatureSettings(detector=name), **{name: group}))
    for parameter, getter in getters.items():
        if hasattr(used(made), f'get{getter}'):  # older releases tell less of SIFT
            assert getattr(used(made), f'get{getter}')() == pytest.approx(changes[parameter])


@pytest.mark.parametrize('factor, levels', [(1.2, 8), (1.5, 4)])
def test_scales_of_orb_are_those_of_its_pyramid(grey, factor, levels):
    orb = dataclasses.replace(FeatureSettings().orb, scale_factor=factor, levels=levels)
    found = make_detector(dataclasses.replace(FeatureSettings(), orb=orb)).detect(grey)
    np.testing.assert_allclose(np.unique(found.scales), factor ** np.arange(levels), rtol=1e-5)


@pytest.mark.parametrize('name, changes', [
    ('sift', {'sigma': 2.4}), ('sift', {'octave_layers': 2}), ('sift', {}),
    ('surf', {'intervals': 3}), ('surf', {'intervals': 5})])
def test_the_finest_scale_is_one(grey, name, changes):
    """Up to half a step between filters, as maxima are interpolated."""
    group = dataclasses.replace(getattr(FeatureSettings(), name), **changes)
    found = make_detector(dataclasses.replace(
        FeatureSettings(detector=name), **{name: group})).detect(grey)
    assert 0.7 < found.scales.min() < 1.05
    assert np.mean(found.scales > 1.0) > 0.5


@pytest.mark.parametrize('changes', [{'octaves': 2}, {'intervals': 4}, {'init_sample': 3},
                                     {'threshold': 1e-3}])
def test_surf_finds_blobs_by_its_settings(grey, changes):
    surf = dataclasses.replace(FeatureSettings().surf, **changes)
    found = make_detector(dataclasses.replace(FeatureSettings(detector='surf'), surf=surf)).detect(
        grey)
    blobs = find_blobs(grey, surf.octaves, surf.intervals, surf.init_sample, surf.threshold)
    np.testing.assert_array_equal(found.pixels, blobs.pixels)
    np.testing.assert_array_equal(found.responses, blobs.responses)
    # a filter of side 9 approximates a Gaussian of 1.2 px, and that of 15 has the first maxima
    np.testing.assert_allclose(found.scales, blobs.sizes / 15, rtol=1e-6)
    np.testing.assert_allclose(
        found.descriptors, describe(grey, blobs.pixels, 1.2 / 9 * blobs.sizes), atol=1e-6)


@pytest.mark.parametrize('name', DETECTORS)
def test_a_detector_goes_to_another_process(grey, name):
    made = detector(name)
    other = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(other.detect(grey).pixels, made.detect(grey).pixels)


def test_another_process_has_the_same_settings():
    sift = dataclasses.replace(FeatureSettings().sift, nfeatures=77)
    made = make_detector(FeatureSettings(detector='sift', sift=sift))
    assert vars(pickle.loads(pickle.dumps(made)))['_settings'] == vars(made)['_settings']


def test_a_small_image_is_described_with_its_size():
    with pytest.raises(InputError) as raised:
        detector('orb').detect(np.zeros((3, 640), np.uint8))
    assert str(raised.value) == (
        'an image of 640 x 3 pixels is too small for the pyramid: lower features.orb.levels or '
        'features.orb.scale_factor')


def test_the_detector_is_the_one_that_is_named():
    for name in DETECTORS:
        assert type(detector(name)).__name__.lower() == f'{name}detector'
