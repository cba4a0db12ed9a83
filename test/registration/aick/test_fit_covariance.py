# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Covariance of a fit against Monte Carlo, and against the true motion in a rendered room."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.consistency import nees
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.geometry import point_fit, se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.aick.fit_covariance import _CELL, _cell_counts, fit_covariance
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COUNT = 60
T_TARGET_SOURCE = se3.exp([0.1, -0.05, 0.2, 0.1, 0.2, -0.1])
MATCHES = np.column_stack([np.arange(COUNT)] * 2)


def keypoints(positions, roots, pixels):
    """Return keypoints with noise covariances ``roots @ roots^T``."""
    covariances = roots @ roots.transpose(0, 2, 1)
    return KeypointFrame(0, positions.astype(np.float32), np.zeros((len(positions), 32), np.uint8),
                         covariances.astype(np.float32), pixels.astype(np.float32))


def error(T, truth):
    return np.r_[truth[:3, 3] - T[:3, 3], se3.log_rotation(truth[:3, :3] @ T[:3, :3].T)]


@pytest.mark.parametrize('group', [1, 4], ids=['single', 'four per cell'])
@pytest.mark.parametrize('larger', [1.0, 3.0], ids=['noise as modelled', 'three times the noise'])
def test_consistent_with_monte_carlo(group, larger):
    """Each keypoint has its own covariance; keypoints of one cell share their noise."""
    rng = np.random.default_rng(7)
    places = rng.uniform((-1, -1, 1), (1, 1, 3), (COUNT // group, 3))
    roots = rng.normal(0, 0.004, (2, COUNT // group, 3, 3))
    pixels = 4.0 * np.column_stack([np.arange(COUNT // group), np.full(COUNT // group, 50)]) + 1
    positions = np.repeat(places, group, axis=0)
    found = []
    for _ in range(300):
        noise = larger * np.einsum('snij,snj->sni', roots, rng.normal(size=(2, *places.shape)))
        noisy = positions + np.repeat(noise[0], group, axis=0), se3.transform(
            T_TARGET_SOURCE, positions) + np.repeat(noise[1], group, axis=0)
        source, target = (keypoints(points, np.repeat(root, group, axis=0),
                                    np.repeat(pixels, group, axis=0))
                          for points, root in zip(noisy, roots))
        T = point_fit.fit(*noisy)
        found.append(nees(error(T, T_TARGET_SOURCE),
                          fit_covariance(T, source, target, MATCHES)))
    assert 5.0 < np.mean(found) < 7.0  # 6 expected, standard deviation of the mean 0.2


@pytest.mark.parametrize('count', [3, 4, 10])
def test_large_residuals_scale_it_by_chi_square_per_degree_of_freedom(count):
    """Three numbers per match, less the six that the fit takes; three matches leave none."""
    rng = np.random.default_rng(2)
    positions, roots = rng.uniform(1, 3, (count, 3)), np.tile(0.01 * np.eye(3), (count, 1, 1))
    pixels = 10.0 * np.column_stack([np.arange(count), np.arange(count)])
    source = keypoints(positions, roots, pixels)
    moved = se3.transform(T_TARGET_SOURCE, positions)
    residuals = rng.normal(0, 0.05, (count, 3))
    found, least = (fit_covariance(T_TARGET_SOURCE, source, keypoints(points, roots, pixels),
                                   MATCHES[:count]) for points in (moved + residuals, moved))
    chi_square = (residuals ** 2).sum() / (2 * 0.01 ** 2)
    np.testing.assert_allclose(found, chi_square / max(3 * count - 6, 1) * least, rtol=1e-3)


@pytest.mark.parametrize('columns, rows', [(5.5, 5.5), (9.5, 2.5), (2.5, 9.5)])
def test_keypoints_share_a_cell_if_both_numbers_of_theirs_agree(columns, rows):
    pixels = np.random.default_rng(0).uniform(0, (columns * _CELL, rows * _CELL), (60, 2))
    cells = [tuple(cell) for cell in (pixels // _CELL).astype(int)]
    np.testing.assert_array_equal(_cell_counts(pixels), [cells.count(cell) for cell in cells])


def test_small_residuals_do_not_reduce_the_covariance():
    """Residuals of matches are small by selection."""
    rng = np.random.default_rng(1)
    positions = rng.uniform((-1, -1, 1), (1, 1, 3), (COUNT, 3))
    roots = np.tile(0.005 * np.eye(3), (COUNT, 1, 1))
    pixels = 10.0 * np.column_stack([np.arange(COUNT), np.arange(COUNT)])
    source = keypoints(positions, roots, pixels)
    target = keypoints(se3.transform(T_TARGET_SOURCE, positions), roots, pixels)
    covariance = fit_covariance(T_TARGET_SOURCE, source, target, MATCHES)
    # variance of a mean of noisy points in both frames; the rotation adds to it
    assert np.trace(covariance[:3, :3]) >= 3 * 2 * 0.005 ** 2 / COUNT


@pytest.mark.parametrize('name', ['paper-full', 'paper-fast', 'paper-fast-surf'])
def test_consistent_in_a_rendered_room(name):
    camera = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    room = SyntheticSource(SyntheticOptions(seed=4, frames=150, camera=camera))
    settings = preset(name)
    extractor, aick = KeypointExtractor(settings.features, settings.sensor), Aick(settings.aick)
    found = []
    for index in range(0, 150, 10):
        frames = room.frame(index), room.frame(index + 1)
        target, source = map(extractor.extract, frames)
        result = aick.register(source, target)
        truth = se3.inverse(room.pose(frames[0].stamp)) @ room.pose(frames[1].stamp)
        found.append(nees(error(result.T_target_source, truth), result.covariance))
    assert 2.0 < np.mean(found) < 12.0
    assert np.mean(np.array(found) < 12.59) > 0.7
