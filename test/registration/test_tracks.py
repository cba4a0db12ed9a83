# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracks against closed forms."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames import depth
from aick_ros.geometry import se3
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import SensorSettings


def test_tracks_near_a_pose_are_counted():
    rng, pose = np.random.default_rng(3), se3.exp([0.1, -0.2, 0.05, 0.02, -0.1, 0.05])
    points = rng.uniform((-1, -1, 1), (1, 1, 3), (50, 3))
    seen = se3.transform(pose, points)
    offsets = np.linspace(0, 0.01, 50)[:, None] * (0.6, -0.8)
    tracks = Tracks(np.arange(50), points, seen[:, :2] / seen[:, 2:] + offsets, np.ones(50),
                    np.ones(50))
    assert tracks.count_near(pose, 0.0051) == 25
    assert tracks.count_near(np.eye(4), 1e-3) < 5


def test_the_displacement_is_the_mean_way_of_the_tracks_in_pixels():
    points = np.array([(0.5, -0.2, 2.0), (-1.0, 0.3, 4.0)])
    rays = points[:, :2] / points[:, 2:] + [(0.03, 0.04), (0.0, -0.01)]
    tracks = Tracks(np.arange(2), points, rays, points[:, 2], np.ones(2))
    assert tracks.displacement(100.0) == pytest.approx(3.0)
    assert tracks[np.zeros(2, bool)].displacement(100.0) == 0.0
    with pytest.raises(ValueError, match='the rays has 4 numbers: 2 are required'):
        dataclasses.replace(tracks, points=points[:1]).displacement(100.0)


def some_tracks(count):
    rng = np.random.default_rng(count)
    depths = np.where(rng.random(count) < 0.7, rng.uniform(0.5, 4.0, count), np.nan)
    return Tracks(rng.permutation(count), rng.uniform(0.5, 4.0, (count, 3)),
                  rng.normal(size=(count, 2)), depths, rng.uniform(0.0, 0.01, count))


@pytest.mark.parametrize('count', [0, 1, 40])
@pytest.mark.parametrize('exponent', [1.5, 2.0])
def test_reversed_tracks_are_those_with_a_depth_from_the_target_to_the_source(count, exponent):
    sensor = SensorSettings(depth_sigma=0.004, depth_exponent=exponent)
    tracks = some_tracks(count)
    swapped, kept = tracks.reversed(sensor), tracks[np.isfinite(tracks.depths)]
    z = kept.depths
    np.testing.assert_array_equal(swapped.keypoints, kept.keypoints)
    np.testing.assert_allclose(swapped.points,
                               np.column_stack([kept.rays, np.ones(len(z))]) * z[:, None])
    np.testing.assert_allclose(swapped.rays, kept.points[:, :2] / kept.points[:, 2:])
    np.testing.assert_array_equal(swapped.depths, kept.points[:, 2])
    np.testing.assert_allclose(swapped.sigmas,
                               np.maximum(depth.inverse_depth_sigma(z, sensor), kept.sigmas))


@pytest.mark.parametrize('name', ['points', 'rays', 'depths', 'sigmas'])
def test_reversed_tracks_have_a_row_each(name):
    tracks = some_tracks(5)
    short = dataclasses.replace(tracks, **{name: getattr(tracks, name)[:4]})
    with pytest.raises(ValueError, match=f'the {name} has .* numbers: .* are required'):
        short.reversed(SensorSettings())


def test_a_track_without_depth_is_as_far_as_the_pose_puts_it():
    """With one it is as far as the target measures."""
    rng, pose = np.random.default_rng(4), se3.exp([0.1, -0.05, 0.02, 0.02, 0.05, -0.01])
    points = rng.uniform((-1, -1, 2), (1, 1, 3), (30, 3))
    seen = se3.transform(pose, points)
    depths = 1.1 * seen[:, 2]
    depths[::2] = np.nan
    tracks = Tracks(np.arange(30), points, seen[:, :2] / seen[:, 2:], depths, np.ones(30))
    factors = np.where(np.arange(30) % 2, 1.1, 1.0)[:, None]
    np.testing.assert_allclose(tracks.seen_by_target(pose), factors * seen, atol=1e-9)
