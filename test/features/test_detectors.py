# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The contract of all detectors, and their repeatability under known image changes."""

import cv2
import numpy as np
import pytest

from aick_ros.features import make_detector
from aick_ros.features.descriptors import descriptor_distances
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
