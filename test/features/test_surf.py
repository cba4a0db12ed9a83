# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SURF with other settings than the defaults."""

import cv2
import numpy as np
import pytest

from aick_ros.features.haar import describe
from aick_ros.features.hessian import find_blobs
from aick_ros.features.surf import SurfDetector
from aick_ros.settings import FeatureSettings, SurfSettings


@pytest.fixture(scope='module')
def grey():
    rng = np.random.default_rng(0)
    return cv2.GaussianBlur(rng.integers(0, 256, (160, 220), np.uint8), (0, 0), 2.0)


@pytest.mark.parametrize('settings', [
    {}, {'octaves': 2, 'intervals': 4, 'init_sample': 1, 'threshold': 1e-4}])
def test_features_are_the_blobs_of_the_settings_and_their_descriptors(grey, settings):
    surf = SurfSettings(**settings)
    found = SurfDetector(FeatureSettings(surf=surf)).detect(grey)
    blobs = find_blobs(grey, surf.octaves, surf.intervals, surf.init_sample, surf.threshold)
    assert len(found.pixels) > 30
    np.testing.assert_array_equal(found.pixels, blobs.pixels)
    np.testing.assert_array_equal(found.responses, blobs.responses)
    assert (found.responses > surf.threshold).all()
    # of the smallest filters, 9 and 15, the second is the finest that has maxima; a filter of
    # nine pixels approximates a Gaussian of 1.2 (Bay et al. 2008)
    np.testing.assert_allclose(found.scales, blobs.sizes / 15, rtol=1e-6)
    np.testing.assert_allclose(found.descriptors,
                               describe(grey, blobs.pixels, 1.2 * blobs.sizes / 9), atol=1e-6)


def test_a_blob_twice_as_large_has_twice_the_scale():
    x, y = np.meshgrid(np.arange(200), np.arange(200))
    scales = []
    for sigma in (4.0, 8.0):
        blob = np.uint8(30 + 200 * np.exp(-0.5 * ((x - 100) ** 2 + (y - 100) ** 2) / sigma ** 2))
        found = SurfDetector(FeatureSettings()).detect(blob)
        best = found.responses.argmax()
        np.testing.assert_allclose(found.pixels[best], 100, atol=0.5)
        scales.append(found.scales[best])
    assert scales[1] / scales[0] == pytest.approx(2.0, rel=0.1)
