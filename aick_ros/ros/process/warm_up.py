# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Work that would otherwise delay the first frame."""

from __future__ import annotations

import importlib

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.settings import Settings


def warm_up(settings: Settings) -> None:
    """
    Register two frames of noise, a column of pixels apart.

    The libraries load and allocate at their first use, which takes as long as several frames.
    NumPy loads a module at the first median, percentile or set, as of the diagnostics.
    """
    importlib.import_module('numpy.ma')
    tiles = np.random.default_rng(0).integers(0, 256, (48, 64), np.uint8)
    grey = np.kron(tiles, np.ones((10, 10), np.uint8))
    colour = np.repeat(grey[..., None], 3, axis=2)
    depth = np.full(grey.shape, 0.5 * (settings.sensor.min_depth + settings.sensor.max_depth),
                    np.float32)
    camera = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    odometry = Odometry(settings)
    for i in (1, 2):  # images that repeat would not be registered
        odometry.register_frame(RgbdFrame(i * NANOSECONDS, np.roll(colour, i, axis=1),
                                          (1.0 + 1e-4 * i) * depth, camera))
