# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SIFT with other settings than the defaults: what each of them says is what is found."""

import dataclasses
import pickle

import cv2
import numpy as np
import pytest

from aick_ros.features.sift import SiftDetector
from aick_ros.settings import FeatureSettings, SiftSettings


def blobs(sigmas, amplitude=100.0, axes=(1.0, 1.0)):
    """Return an image of Gaussian blobs, 100 pixels apart, and their centres."""
    centres = [(50 + 100 * i, 60) for i in range(len(sigmas))]
    x, y = np.meshgrid(np.arange(100 * len(sigmas)), np.arange(120))
    image = np.full(x.shape, 60.0)
    for (u, v), sigma in zip(centres, sigmas):
        image += amplitude * np.exp(-0.5 * (((x - u) / axes[0]) ** 2 + ((y - v) / axes[1]) ** 2)
                                    / sigma ** 2)
    return np.rint(image).astype(np.uint8), np.float32(centres)


def detect(grey, **settings):
    return SiftDetector(FeatureSettings(sift=SiftSettings(**settings))).detect(grey)


@pytest.mark.parametrize('sigma, layers', [(1.6, 3), (1.2, 5)])
def test_scales_are_those_of_the_blobs_relative_to_the_finest(sigma, layers):
    """
    A blob is an extremum at its own sigma; the finest extremum is one layer above the first.

    The first scale, of the doubled image, is of half the sigma of the settings.
    """
    sigmas = np.array([2.0, 3.0, 4.5, 6.0])
    grey, centres = blobs(sigmas)
    found = detect(grey, sigma=sigma, octave_layers=layers)
    finest = 0.5 * sigma * 2.0 ** (1.0 / layers)
    for centre, expected in zip(centres, sigmas / finest):
        near = np.linalg.norm(found.pixels - centre, axis=1) < 1.0
        assert near.any()
        strongest = found.scales[near][found.responses[near].argmax()]
        assert strongest == pytest.approx(expected, rel=0.2)


def test_strong_blobs_respond_more_and_weak_ones_are_rejected():
    grey, centres = blobs([3.0])
    faint, _ = blobs([3.0], amplitude=30.0)
    strong, weak = detect(grey), detect(faint)
    assert strong.responses.max() > 2.5 * weak.responses.max() > 0
    assert len(detect(grey, contrast_threshold=0.9).pixels) == 0


def test_edges_are_rejected_beyond_their_ratio():
    """A blob four times as long as wide has curvatures of about 1 to 16."""
    grey, centres = blobs([3.0], axes=(1.0, 4.0))

    def is_found(ratio):
        found = detect(grey, edge_threshold=ratio, contrast_threshold=0.01)
        return bool((np.linalg.norm(found.pixels - centres[0], axis=1) < 4.0).any())
    assert is_found(100.0) and not is_found(2.0)


def test_no_more_keypoints_are_found_than_asked_for():
    grey = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (200, 300), np.uint8),
                            (0, 0), 1.5)
    assert len(detect(grey).pixels) > 100
    assert len(detect(grey, nfeatures=25).pixels) in range(25, 28)


@pytest.mark.parametrize('layers', [1, 3, 8])
def test_the_finest_extremum_is_within_half_a_layer_of_the_scale_one(layers):
    grey = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (200, 300), np.uint8),
                            (0, 0), 1.0)
    found = detect(grey, octave_layers=layers, nfeatures=20000, contrast_threshold=0.0)
    assert 2.0 ** (-0.55 / layers) < found.scales.min() < 1.0


def test_another_process_gets_the_same_detector():
    grey, _ = blobs([2.0, 4.0])
    detector = SiftDetector(FeatureSettings(sift=SiftSettings(octave_layers=5, sigma=1.3)))
    again = pickle.loads(pickle.dumps(detector))
    for field in dataclasses.fields(one := detector.detect(grey)):
        np.testing.assert_array_equal(getattr(one, field.name),
                                      getattr(again.detect(grey), field.name))
    assert len(one.pixels) > 0
