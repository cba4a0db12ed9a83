# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What GICP is given, by a stand-in for the library, of a floor with a closed form."""

import sys
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

NAME = 'aick_ros.evaluation.baselines.small_gicp'


@pytest.fixture
def gicp(monkeypatch):
    """Return the method, whose library returns what it is given."""
    library = SimpleNamespace(preprocess_points=lambda points, *options: (points, options))
    monkeypatch.setitem(sys.modules, 'small_gicp', library)
    monkeypatch.delitem(sys.modules, NAME, raising=False)
    yield import_module(NAME).SmallGicp
    sys.modules.pop(NAME)


@pytest.mark.parametrize('max_depth', [2.0, 5.0])
def test_farther_points_are_ignored(gicp, max_depth):
    """The floor is 1 m below the camera, and seen from 1.3 m to the horizon."""
    row = np.arange(120.0)
    with np.errstate(divide='ignore'):
        depth = np.where(row > 20, 128.0 / (row - 20.0), np.nan)
    image = np.repeat(depth[:, None], 160, axis=1).astype(np.float32)
    frame = RgbdFrame(1, np.zeros((120, 160), np.uint8), image,
                      Camera(160, 120, 130.0, 128.0, 80.2, 20.0))
    points, options = gicp(0.1, 15, 0.5, max_depth, 20, 1e-4).prepare(frame)
    np.testing.assert_allclose(points[:, 1], 1.0, atol=1e-6)
    np.testing.assert_allclose(np.unique(points[:, 2]), np.sort(depth[depth < max_depth]),
                               rtol=1e-6)
    assert options == (0.1, 15, 1)
