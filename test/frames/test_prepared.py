# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth of the scene of a prepared frame, and its sharpness beside others."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.sharpness import Sharpness
from aick_ros.geometry.camera import Camera


def prepared(keypoint_depths, surface_depths=()):
    keypoints, points = (np.column_stack([np.full((len(depths), 2), 5.0), depths])
                         for depths in (keypoint_depths, surface_depths))
    surface = SimpleNamespace(points=np.concatenate([np.full((2, 3), 9.0), points]),
                              chosen=np.arange(2, 2 + len(points)))
    return PreparedFrame(None, SimpleNamespace(positions=keypoints), None, surface)


def test_the_scene_is_at_the_median_depth_of_the_keypoints():
    assert prepared([1.0, 4.0, 2.0], [7.0]).scene_depth == 2.0
    assert prepared([1.0, 4.0, 2.0, 3.0]).scene_depth == pytest.approx(2.5)


def test_without_keypoints_it_is_at_that_of_the_chosen_surface_points():
    assert prepared([], [5.0, 1.0, 3.0]).scene_depth == 3.0


def test_without_clocks_neither_lag_nor_jitter_is_known():
    frame = PreparedFrame(None, None, None)
    assert (frame.depth_lag, frame.stamp_jitter, frame.twist) == (0.0, 0.0, None)


def test_without_either_it_is_unknown():
    assert np.isnan(prepared([]).scene_depth)


def test_a_blurred_image_is_blurred_beside_that_of_another_frame_and_not_the_other_way():
    noise = np.random.default_rng(0).integers(0, 256, (120, 160)).astype(np.uint8)
    sharp, blurred = (PreparedFrame(None, None, image) for image in (
        noise, cv2.GaussianBlur(noise, (0, 0), 5.0)))
    assert blurred.is_blurred_beside(sharp)
    assert not sharp.is_blurred_beside(blurred)
    assert sharp.sharpness == Sharpness.of(noise)


def test_an_image_of_another_size_is_not_blurred_beside_it():
    """As of a camera that enlarges its images from now on."""
    noise = np.random.default_rng(0).integers(0, 256, (120, 160)).astype(np.uint8)
    small, large = (PreparedFrame(None, None, image) for image in (
        noise, cv2.resize(noise, None, fx=8, fy=8, interpolation=cv2.INTER_CUBIC)))
    assert large.sharpness.is_blurred_beside(small.sharpness)
    assert not large.is_blurred_beside(small)


def test_its_stamp_is_that_of_its_colour_image():
    assert PreparedFrame(SimpleNamespace(stamp=7, depth_stamp=9), None, None).stamp == 7


def test_bare_it_has_the_images_of_registrations_alone():
    camera = Camera(32, 24, 30.0, 30.0, 16.0, 12.0)
    colour = np.random.default_rng(0).integers(0, 256, (24, 32, 3)).astype(np.uint8)
    frame = RgbdFrame(1, colour, np.full((24, 32), 1.0, np.float32), camera)
    imu = vars(frame)['imu'] = SimpleNamespace()
    full = PreparedFrame(frame, prepared([1.0]).keypoints, frame.grey)
    sharpness = full.sharpness
    bare = full.bare()
    assert bare.frame.colour is bare.frame.grey is bare.grey is full.grey
    assert bare.frame.depth is full.frame.depth
    assert bare.frame.camera is frame.camera and bare.stamp == frame.stamp
    assert bare.frame.imu is None and full.frame.imu is imu
    assert bare.sharpness is sharpness and bare.keypoints is full.keypoints


@pytest.mark.parametrize('change', ['velocity', 'keypoints'])
def test_what_is_known_of_the_image_is_known_of_a_frame_that_differs_from_it(change):
    before = dataclasses.replace(prepared([1.0, 4.0, 2.0]), grey=np.eye(32, dtype=np.uint8))
    known, depth, others = before.sharpness, before.scene_depth, prepared([3.0]).keypoints
    twist, variances = np.ones((2, 6))
    changes = {'keypoints': others, 'is_tracked': True} if change == 'keypoints' else {
        'twist': twist, 'twist_variances': variances}
    after = (before.moving(twist, variances) if change == 'velocity'
             else before.with_keypoints(others, is_tracked=True))
    expected = dataclasses.replace(before, **changes)
    for field in dataclasses.fields(PreparedFrame):
        assert getattr(after, field.name) is getattr(expected, field.name)
    assert after.sharpness is known and after.scene_depth == expected.scene_depth
    assert (before.twist, before.is_tracked, before.scene_depth) == (None, False, depth)
