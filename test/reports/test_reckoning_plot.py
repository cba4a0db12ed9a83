# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of points: where they are, and which of two hides the other."""

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.benchmark.dead_reckoning import EndPoint, Reckoning
from aick_ros.reports.reckoning_plot import splat, write_reckoning

RED, GREEN, BLUE = np.eye(3, dtype=np.uint8) * 200


def test_points_are_where_their_coordinates_say():
    points = np.array([[0.0, 0.0, 0.0], [0.305, 0.0, 0.105]])
    picture, extent = splat(points, np.array([RED, GREEN]), 0, 2, -1.0)
    assert picture.shape == (11, 31, 3)
    assert extent == pytest.approx((0.0, 0.31, 0.0, 0.11))
    assert (picture[-1, 0] == RED).all()  # the lower left
    assert (picture[0, -1] == GREEN).all()
    assert (picture != 255).any(axis=2).sum() == 2


@pytest.mark.parametrize(('side', 'seen'), [(-1.0, BLUE), (1.0, RED)])
def test_the_nearer_hides_the_farther(side, seen):
    points = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    picture, _ = splat(points, np.array([RED, BLUE]), 0, 2, side)
    assert (picture == seen).all()


def test_it_is_a_picture(tmp_path):
    rng = np.random.default_rng(1)
    line = np.linspace([0, 0, 0], [3, 0, 0], 20)
    write_reckoning(Reckoning(EndPoint(20, 3.0, 0.1, 1.0, 0), line, line,
                              rng.uniform(0, 1, (500, 3)),
                              rng.integers(0, 255, (500, 3), np.uint8)), tmp_path / 'f.png')
    assert min(cv2.imread(str(tmp_path / 'f.png')).shape[:2]) > 1000
