# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arrays of features that fit each other, and those that do not."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features.detector import Features, detect_some, required_descriptors

GOOD = {'pixels': np.zeros((3, 2), np.float32), 'descriptors': np.zeros((3, 32), np.uint8),
        'responses': np.zeros(3, np.float32), 'scales': np.ones(3, np.float32)}


@pytest.mark.parametrize('change', [
    {}, {'descriptors': np.zeros((3, 64), np.float32)},
    {'descriptors': np.zeros((3, 1), np.uint8)},
    {'responses': np.full(3, -1.0, np.float32)}])
def test_arrays_that_fit_are_accepted(change):
    Features(**{**GOOD, **change})


@pytest.mark.parametrize('name, value, sentence', [
    ('pixels', np.zeros((3, 2)), 'pixels of features: an array of float64'),
    ('pixels', np.zeros((3, 3), np.float32), 'Nx2 is required'),
    ('pixels', np.zeros((4, 2), np.float32), 'responses of features: .*the shape 4 is required'),
    ('responses', np.zeros((3, 1), np.float32), 'responses of features'),
    ('responses', np.zeros(2, np.float32), 'responses of features: .*shape 2, .*shape 3'),
    ('scales', np.ones(4, np.float32), 'scales of features: .*shape 4, .*shape 3'),
    ('scales', np.ones(3), 'scales of features: an array of float64'),
    ('descriptors', np.zeros((3, 32), np.int8), 'descriptors of features: an array of int8'),
    ('descriptors', np.zeros((2, 32), np.uint8), 'shape 2x32, .*shape 3xN'),
    ('descriptors', np.zeros(3, np.uint8), 'descriptors of features'),
    ('descriptors', np.zeros((3, 0), np.uint8), 'descriptors of features have no columns'),
    ('descriptors', np.zeros((3, 0), np.float32), 'descriptors of features have no columns'),
    ('descriptors', None, 'descriptors of features: None'),
    *((name, np.full(GOOD[name].shape, value, np.float32), f'^{name} of features are not all '
       'finite: omit such keypoints$')
      for name in ('pixels', 'responses', 'scales') for value in (np.nan, np.inf, -np.inf))])
def test_arrays_that_do_not_fit_are_named(name, value, sentence):
    with pytest.raises(InputError, match=sentence):
        Features(**{**GOOD, name: value})


@pytest.mark.parametrize('kind, is_one', [
    (np.uint8, True), (np.float32, True), (np.float64, False), (np.uint16, False), (bool, False)])
def test_descriptors_are_bytes_or_single_floats(kind, is_one):
    if is_one:
        required_descriptors(np.zeros((5, 8), kind), 5)
    else:
        with pytest.raises(InputError, match='where an array of float32 of the shape 5xN'):
            required_descriptors(np.zeros((5, 8), kind), 5)


def test_a_detector_that_describes_all_is_asked_for_all():
    rng = np.random.default_rng(0)
    every = Features(rng.random((9, 2), np.float32), np.eye(9, dtype=np.uint8),
                     rng.random(9, np.float32), rng.random(9, np.float32))

    class Plain:
        def detect(self, grey):
            return every
    some = detect_some(Plain(), np.zeros((4, 4), np.uint8),
                       lambda pixels, responses: np.argsort(-responses)[:3])
    rows = np.argsort(-every.responses)[:3]
    np.testing.assert_array_equal(some.descriptors, every.descriptors[rows])
    np.testing.assert_array_equal(some.pixels, every.pixels[rows])
    np.testing.assert_array_equal(some.scales, every.scales[rows])
