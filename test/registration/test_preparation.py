# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Preparation of frames on several threads at once."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.registration.preparation import Preparer
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def frames():
    """Return frames of chequered noise on a slope."""
    rng = np.random.default_rng(1)
    depth = np.broadcast_to(np.linspace(1.0, 2.0, 320, dtype=np.float32), (240, 320)).copy()
    return [RgbdFrame(stamp, np.kron(rng.integers(0, 256, (24, 32), np.uint8),
                                     np.ones((10, 10), np.uint8)), depth, CAMERA)
            for stamp in range(4)]


@pytest.mark.parametrize('detector', ['orb', 'surf', 'sift'])
def test_threads_that_share_a_preparer_do_not_disturb_each_other(frames, detector):
    preparer = Preparer(with_values(Settings(), {'features.detector': detector}))
    alone = [preparer.prepare(frame) for frame in frames]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(preparer.prepare, 3 * frames))
    for one, other in zip(3 * alone, together, strict=True):
        np.testing.assert_array_equal(one.keypoints().positions, other.keypoints().positions)
        np.testing.assert_array_equal(one.keypoints().descriptors, other.keypoints().descriptors)
        np.testing.assert_array_equal(one.surface().points, other.surface().points)
        np.testing.assert_array_equal(one.surface().chosen, other.surface().chosen)


def test_each_part_is_made_once(frames):
    preparation = Preparer(Settings()).begin(frames[0])
    assert preparation.keypoints() is preparation.keypoints()
    assert preparation.surface() is preparation.surface()


def test_without_depth_in_the_refinement_there_is_no_surface(frames):
    preparer = Preparer(with_values(Settings(), {'refinement.mode': 'keypoints'}))
    assert preparer.prepare(frames[0]).surface() is None
