# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Flaws of rendered cameras: each one does to the recording what its name says, and no more."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS

FOLDER = Path(__file__).parents[2] / 'benchmarks'
CAMERA = Camera(96, 64, 60.0, 60.0, 47.5, 31.5)
RATE = 20.0
TURNING = 5.0  # by a careful hand


@pytest.fixture(scope='module')
def flawed(load):
    return load(FOLDER / 'flawed_camera.py')


@pytest.fixture(scope='module')
def recording(flawed):
    """Return the function that returns the recording of a camera with flaws."""
    def recorded(count=6, **flaws):
        return flawed.FlawedCamera(4, count, CAMERA, RATE, 'time-of-flight', TURNING,
                                   flawed.Flaws(**flaws)).recording()
    return recorded


@pytest.fixture(scope='module')
def good(recording):
    return recording()


def shift_of(first, second, rows):
    """Return the shift to the right of some rows from one image to another [px]."""
    one, other = (image[rows].astype(float).mean(axis=2) for image in (first, second))
    shifts = range(-6, 7)
    errors = [np.mean((one[:, 8:-8] - np.roll(other, -shift, 1)[:, 8:-8]) ** 2)
              for shift in shifts]
    return shifts[int(np.argmin(errors))]


def test_without_flaws_stamps_are_those_of_the_images(good):
    frames, truth = good
    assert [frame.stamp for frame in frames] == truth.stamps.tolist()
    assert np.diff(truth.stamps) == pytest.approx(NANOSECONDS / RATE, abs=1)


def test_a_latency_lets_the_truth_be_that_of_a_later_time(recording, good):
    """By two frames: the image is the same, the camera is where it will be two frames later."""
    frames, truth = recording(latency=2 / RATE)
    np.testing.assert_array_equal(frames[0].colour, good[0][0].colour)
    assert frames[0].stamp == good[0][2].stamp
    np.testing.assert_allclose(truth.poses[0], good[1].poses[2], atol=1e-12)


def test_stamps_scatter_by_the_jitter(recording):
    frames, _ = recording(40, jitter=0.003)
    stamps = np.array([frame.stamp for frame in frames]) / NANOSECONDS
    assert np.std(stamps - np.arange(len(stamps)) / RATE) == pytest.approx(0.003, rel=0.3)


def test_images_are_missing_or_repeat_by_their_shares(recording):
    dropped, truth = recording(30, drops=0.3)
    assert 12 <= len(dropped) == len(truth.stamps) <= 28
    repeated, _ = recording(30, repeats=0.3)
    same = [np.array_equal(one.colour, other.colour)
            for one, other in zip(repeated, repeated[1:])]
    assert len(repeated) == 30
    assert 2 <= sum(same) <= 18


def test_depth_is_too_long_by_the_scale_and_ends_at_its_range(recording, good):
    (first, *_), _ = recording(scale=0.1)
    assert np.nanmedian(first.depth / good[0][0].depth) == pytest.approx(1.1, rel=1e-3)
    near = np.nanquantile(good[0][0].depth, 0.4)
    (first, *_), _ = recording(max_depth=float(near))
    assert np.nanmax(first.depth) < near + 0.1
    assert np.mean(np.isnan(first.depth)) > 0.5
    (first, *_), _ = recording(holes=0.4)
    assert np.mean(np.isnan(first.depth)) == pytest.approx(
        0.4 + 0.6 * np.mean(np.isnan(good[0][0].depth)), abs=0.05)


def test_a_rolling_shutter_shows_the_first_row_earlier_and_the_last_one_later(recording, good):
    """While the camera turns the rows are where they are half a readout before and after."""
    frames, _ = recording(readout=2 / RATE)
    for rows, other in ((slice(0, 6), 2), (slice(29, 35), 3), (slice(58, 64), 4)):
        seen = frames[3].colour
        assert abs(shift_of(seen, good[0][other].colour, rows)) <= 1
    moved = shift_of(good[0][2].colour, good[0][4].colour, slice(0, 64))
    assert abs(moved) >= 4  # so that a shift of a pixel is little


def test_the_depth_of_a_rolling_shutter_is_that_of_the_time_of_its_row(recording, good):
    frames, _ = recording(depth_readout=2 / RATE)
    np.testing.assert_array_equal(frames[3].colour, good[0][3].colour)
    for rows, other in ((slice(0, 6), 2), (slice(29, 35), 3), (slice(58, 64), 4)):
        errors = [np.nanmedian(np.abs(frames[3].depth - frame.depth)[rows, 8:-8])
                  for frame in good[0]]
        assert np.argmin(errors) == other


def test_a_lens_moves_the_edges_alone(recording, good):
    """By k r^3 of the focal length, outwards for a positive coefficient."""
    (first, *_), _ = recording(distortion=0.08)
    difference = np.abs(first.colour.astype(float) - good[0][0].colour).mean(axis=2)
    assert difference[24:40, 40:56].mean() < 0.5 * difference[:, [0, 1, 2, -3, -2, -1]].mean()


def test_depth_of_another_place_is_beside_the_colour_image(recording, good):
    (first, *_), _ = recording(offset=(0.0, 0.0, 0.0, 0.0, 0.05, 0.0))
    one, other = (np.nan_to_num(frame.depth) for frame in (first, good[0][0]))
    errors = [np.median(np.abs(one[:, 8:-8] - np.roll(other, shift, 1)[:, 8:-8]))
              for shift in range(-5, 6)]
    assert abs(np.argmin(errors) - 5) == 3  # px: 60 px times 0.05 rad


def test_stamps_have_jitter_and_latency_together_or_neither(flawed):
    drawn = [flawed.Flaws.drawn(np.random.default_rng(seed), 30.0) for seed in range(200)]
    assert all((flaws.jitter > 0) == (flaws.latency > 0) for flaws in drawn)
    assert 60 < sum(flaws.jitter > 0 for flaws in drawn) < 140
    assert max(flaws.jitter for flaws in drawn) <= 0.15 / 30
    for name in ('readout', 'depth_readout', 'delay', 'scale', 'drops', 'repeats', 'holes',
                 'distortion'):
        assert 30 < sum(getattr(flaws, name) != 0 for flaws in drawn) < 140


def test_a_camera_is_named_by_what_it_has(flawed):
    assert str(flawed.Flaws()) == 'none'
    assert str(flawed.Flaws(scale=0.012, jitter=0.002, max_depth=2.0)) == (
        'scale +1.2 %, jitter 2.0 ms, up to 2.0 m')
    given = dataclasses.replace(flawed.Flaws(), offset=(0.003, 0.0, 0.004, 0.0, 0.0, 0.0))
    assert str(given) == 'offset 5 mm'
