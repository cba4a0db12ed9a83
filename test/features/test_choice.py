# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Each name of a detector gives the detector of that name, with its settings."""

import pytest

from aick_ros.features import make_detector
from aick_ros.settings import FeatureSettings


@pytest.mark.parametrize('name, kind, width', [
    ('orb', 'OrbDetector', 32), ('surf', 'SurfDetector', 64), ('sift', 'SiftDetector', 128)])
def test_the_detector_is_that_of_the_name(name, kind, width):
    import numpy as np
    detector = make_detector(FeatureSettings(detector=name))
    assert type(detector).__name__ == kind
    assert detector.detect(np.zeros((200, 200), np.uint8)).descriptors.shape == (0, width)
