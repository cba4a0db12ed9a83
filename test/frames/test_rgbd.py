# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames: what belongs together, and keypoints where the scene really is."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.settings import FeatureSettings, SensorSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
COLOUR = np.zeros((480, 640, 3), np.uint8)
DEPTH = np.ones((480, 640), np.float32)


@pytest.fixture(scope='module')
def rendered():
    return SyntheticSource(SyntheticOptions.perfect(seed=3, frames=20))


def extract(frame, **features):
    return KeypointExtractor(FeatureSettings(**features), SensorSettings()).extract(frame)


@pytest.mark.parametrize('changes, sentence', [
    ({'depth': DEPTH[::2, ::2]}, 'colour is 640 x 480 and depth 320 x 240 pixels'),
    ({'camera': dataclasses.replace(CAMERA, width=1280, height=720)}, 'calibrated for 1280 x 720'),
    ({'colour': COLOUR.astype(np.uint16)}, 'the colour image is uint16'),
    ({'colour': np.zeros((480, 640, 4), np.uint8)}, 'it takes uint8 of HxW or HxWx3'),
    ({'depth': DEPTH.astype(np.float64)}, 'the depth image is float64'),
    ({'depth': COLOUR}, 'it takes float32 metres'),
])
def test_refuses_images_that_do_not_belong_together(changes, sentence):
    fields = {'stamp': 0, 'colour': COLOUR, 'depth': DEPTH, 'camera': CAMERA, **changes}
    with pytest.raises(InputError, match=sentence):
        RgbdFrame(**fields)


def test_keypoints_lie_where_the_scene_is(rendered):
    """The depth the renderer gives at the four pixels around a keypoint encloses its own."""
    frame = rendered.frame(0)
    keypoints = extract(frame)
    assert len(keypoints) > 300
    np.testing.assert_allclose(frame.camera.project(keypoints.positions), keypoints.pixels,
                               atol=1e-3)
    column, row = np.floor(keypoints.pixels).astype(int).T
    around = np.stack([frame.depth[np.clip(row + i, 0, 479), np.clip(column + j, 0, 639)]
                       for i in (0, 1) for j in (0, 1)])
    assert np.all(keypoints.positions[:, 2] >= np.nanmin(around, axis=0) - 1e-5)
    assert np.all(keypoints.positions[:, 2] <= np.nanmax(around, axis=0) + 1e-5)


def test_the_strongest_are_kept(rendered):
    every = extract(rendered.frame(0), max_keypoints=0)
    some = extract(rendered.frame(0), max_keypoints=100, cell_size=0.0)
    assert len(some) == 100
    assert len(every) > 300
    np.testing.assert_array_equal(some.pixels, every.pixels[:100])
    np.testing.assert_array_equal(some.descriptors, every.descriptors[:100])
    assert some.descriptors.dtype == np.uint8
    assert some.positions.dtype == some.covariances.dtype == np.float32


def test_every_keypoint_knows_its_uncertainty(rendered):
    keypoints = extract(rendered.frame(0))
    assert keypoints.covariances.shape == (len(keypoints), 3, 3)
    assert np.all(np.linalg.eigvalsh(keypoints.covariances.astype(float)) > 0)
    along_z = np.sqrt(keypoints.covariances[:, 2, 2])
    np.testing.assert_allclose(
        along_z, SensorSettings().depth_sigma * keypoints.positions[:, 2] ** 2, rtol=1e-3)


def test_grey_images_do(rendered):
    frame = rendered.frame(0)
    grey = dataclasses.replace(frame, colour=frame.grey)
    np.testing.assert_array_equal(extract(grey).pixels, extract(frame).pixels)


@pytest.mark.parametrize('changes', [
    {'colour': COLOUR}, {'depth': np.full_like(DEPTH, np.nan)},
    {'colour': COLOUR, 'depth': np.full_like(DEPTH, np.nan)}], ids=['black', 'no depth', 'both'])
def test_where_nothing_is_seen_there_are_no_keypoints(rendered, changes):
    keypoints = extract(dataclasses.replace(rendered.frame(0), **changes))
    assert len(keypoints) == 0
    assert keypoints.positions.shape == (0, 3)
    assert keypoints.covariances.shape == (0, 3, 3)
    assert keypoints.descriptors.shape[0] == 0


def test_keypoints_that_the_camera_model_cannot_place_are_left_out(rendered):
    frame = rendered.frame(0)
    wide = dataclasses.replace(frame, camera=Camera(640, 480, 150, 150, 320, 240, 'equidistant',
                                                    (0.02, -0.01, 0.003, -0.001)))
    keypoints = extract(wide)
    assert 0 < len(keypoints)
    assert np.isfinite(keypoints.positions).all()
    assert np.hypot(*(keypoints.pixels - (320, 240)).T).max() < 150 * np.pi / 2


@pytest.mark.parametrize('size', [(1, 1), (1, 640), (3, 3)])
def test_an_image_too_small_for_the_pyramid_is_refused(size):
    frame = RgbdFrame(0, np.zeros(size, np.uint8), np.ones(size, np.float32),
                      dataclasses.replace(CAMERA, width=size[1], height=size[0]))
    with pytest.raises(InputError, match='too small for the pyramid'):
        extract(frame)
