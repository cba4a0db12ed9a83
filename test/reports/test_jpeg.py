# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Packed images, unpacked by OpenCV."""

import cv2
import numpy as np
import pytest

from aick_ros.reports.jpeg import to_jpeg


@pytest.mark.parametrize('colour', [(250, 20, 60), (10, 200, 90)])
def test_colours_stay_red_green_blue(colour):
    content = to_jpeg(np.full((16, 24, 3), colour, np.uint8))
    seen = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert content[:2] == b'\xff\xd8' and seen.shape == (16, 24, 3)
    np.testing.assert_allclose(seen[8, 12, ::-1], colour, atol=4)


def test_grey_stays_grey_and_small():
    ramp = np.tile(np.arange(0, 240, 2, dtype=np.uint8), (64, 1))
    content = to_jpeg(ramp)
    seen = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(seen, ramp, atol=6)
    assert len(content) < ramp.size / 4


def test_the_quality_is_lower_than_that_of_archives():
    noise = np.random.default_rng(0).integers(0, 255, (64, 64), np.uint8)
    sizes = [len(cv2.imencode('.jpg', noise, [cv2.IMWRITE_JPEG_QUALITY, quality])[1])
             for quality in (70, 90)]
    assert sizes[0] < len(to_jpeg(noise)) < sizes[1]
