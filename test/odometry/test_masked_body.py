# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A robot that sees its own body: behind a mask it makes no difference, without one it does."""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros.frames.mask import ImageMask, MaskedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT, DARK = 24, 14
CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
BODY = np.s_[120:, 160:]
DISTANCE = 0.6  # m


@pytest.fixture(scope='module')
def rendered():
    """Return frames of a room, the same with the body of the robot in a quarter, and the path."""
    source = SyntheticSource(SyntheticOptions(seed=2, frames=COUNT, camera=CAMERA))
    frames, rng = [source.frame(i) for i in range(COUNT)], np.random.default_rng(3)
    texture = cv2.resize(rng.integers(0, 256, (30, 40), np.uint8), (160, 120),
                         interpolation=cv2.INTER_NEAREST)
    with_body = []
    for frame in frames:
        colour, depth = frame.colour.copy(), frame.depth.copy()
        colour[BODY] = np.clip(texture + rng.normal(0.0, 2.0, texture.shape), 0, 255)[..., None]
        depth[BODY] = rng.normal(DISTANCE, 0.0008, texture.shape)
        with_body.append(dataclasses.replace(frame, colour=colour, depth=depth))
    truth = [source.ground_truth.at(frame.stamp) for frame in frames]
    return frames, with_body, truth


@pytest.fixture
def mask(tmp_path):
    image = np.full((240, 320), 255, np.uint8)
    image[BODY] = 0
    cv2.imwrite(str(tmp_path / 'mask.png'), image)
    return {'sensor.mask': str(tmp_path / 'mask.png')}


def path_of(frames, settings):
    odometry = Odometry(settings)
    return [odometry.register_frame(frame).T_odom_camera for frame in frames]


def error_of(path, truth):
    """Return the largest error of the position [m]."""
    return max(np.linalg.norm((se3.inverse(se3.inverse(truth[0]) @ true) @ T)[:3, 3])
               for true, T in zip(truth, path))


def without_light(frames):
    return [dataclasses.replace(frame, colour=np.zeros_like(frame.colour)) if i >= DARK else frame
            for i, frame in enumerate(frames)]


def with_copies(frames):
    """Return frames of which one comes again under the next stamp."""
    return [dataclasses.replace(frames[7], stamp=frame.stamp) if i == 8 else frame
            for i, frame in enumerate(frames)]


@pytest.mark.parametrize('settings, darken', [
    (Settings(), list), (preset('embedded'), list), (preset('paper-full'), list),
    (Settings(), without_light), (Settings(), with_copies)],
    ids=['AICK', 'tracking', 'paper', 'depth alone', 'repeated'])
def test_behind_a_mask_a_body_makes_no_difference(rendered, mask, settings, darken):
    """Not by a bit: nothing of it is used. Without the mask the camera seems to stay with it."""
    frames, with_body, truth = rendered
    masked = with_values(settings, mask)
    path = path_of(darken(with_body), masked)
    np.testing.assert_array_equal(path, path_of(darken(frames), masked))
    unaffected = error_of(path_of(darken(frames), settings), truth)
    length = np.linalg.norm(truth[-1][:3, 3] - truth[0][:3, 3])
    assert unaffected < 0.03 < 0.1 * length
    assert error_of(path, truth) < 2 * unaffected + 0.005
    assert error_of(path_of(darken(with_body), settings), truth) > 5 * unaffected + 0.05


def test_a_mask_may_be_set_while_the_odometry_runs(rendered, mask):
    """Frames before are prepared again. After some frames the body carries nothing any more."""
    _, with_body, truth = rendered
    odometry, path = Odometry(), []
    for index, frame in enumerate(with_body):
        if index == 4:
            odometry.change_settings(with_values(Settings(), mask))
        path.append(odometry.register_frame(frame).T_odom_camera)
    moved, true = (se3.inverse(poses[8]) @ poses[-1] for poses in (path, truth))
    assert np.linalg.norm(true[:3, 3]) > 0.2
    assert np.linalg.norm((se3.inverse(true) @ moved)[:3, 3]) < 0.01


@pytest.mark.parametrize('settings', [Settings(), preset('embedded')], ids=['AICK', 'tracking'])
def test_each_frame_is_masked_once(rendered, mask, settings, monkeypatch):
    """Where AICK fails, too, which then seeks more keypoints; a repeated frame stays masked."""
    frames, masked, applied = rendered[0], [], ImageMask.applied
    monkeypatch.setattr(ImageMask, 'applied', lambda self, frame: (
        masked.append(frame.stamp), applied(self, frame))[1])
    frames = with_copies(frames)[:11]
    frames[10] = dataclasses.replace(frames[10], colour=frames[10].colour[::-1].copy())
    odometry = Odometry(with_values(settings, mask))
    updates = [odometry.register_frame(frame) for frame in frames]
    assert [update.status is Status.REPEATED for update in updates] == [
        index == 8 for index in range(11)]
    assert all(isinstance(update.prepared.frame, MaskedFrame) for update in updates)
    assert masked == [frame.stamp for frame in frames]
