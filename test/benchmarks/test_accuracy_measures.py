# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Measures of docs/accuracy.md on paths and images whose figures are known."""

from pathlib import Path

import numpy as np
import pytest

from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FOLDER = Path(__file__).parents[2] / 'benchmarks' / 'accuracy'
MILLISECOND = 1_000_000
SMALL = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


@pytest.fixture(scope='module')
def source():
    return SyntheticSource(SyntheticOptions.perfect(seed=5, frames=16, camera=SMALL,
                                                    depth_delay=0.01))


@pytest.fixture(scope='module')
def registered(load):
    return load(FOLDER / 'registered.py')


def straight(length, step, scale=1.0, turn=0.0):
    """Return a path along x, each step too long by a factor and turned too far by an angle."""
    step = se3.exp([scale * step, 0.0, 0.0, 0.0, 0.0, turn])
    poses = [np.eye(4)]
    while len(poses) <= length:
        poses.append(poses[-1] @ step)
    return Trajectory(33 * MILLISECOND * np.arange(len(poses)), np.array(poses))


def test_growth_is_the_share_of_the_way(load):
    errors = compare(straight(100, 0.0101, 1.02), straight(100, 0.0101))
    figures = load(FOLDER / 'growth.py').growth(errors)
    # a part ends at the first frame that is so far, and the path is 1.01 m long
    assert {name: part['count'] for name, part in figures.items()} == {
        '0.1': 91, '0.2': 81, '0.5': 51}
    assert figures['0.1']['translation_rmse_m'] == pytest.approx(0.02 * 0.101)
    assert figures['0.5']['translation_rmse_m'] == pytest.approx(0.02 * 0.505)


def test_growth_of_the_turn(load):
    errors = compare(straight(100, 0.0101, turn=np.radians(0.1)), straight(100, 0.0101))
    figures = load(FOLDER / 'growth.py').growth(errors)
    assert figures['0.5']['rotation_rmse_deg'] == pytest.approx(5.0)


def test_frames_are_skipped_and_depth_stamps_removed(load, source):
    altered = load(FOLDER / 'altered.py').Altered
    frames = list(altered(source, 9, 4, one_clock=True).frames(raise_damage))
    assert [frame.stamp for frame in frames] == [source.frame(i).stamp for i in (0, 4, 8)]
    assert len(altered(source, 9, 4)) == 3
    assert all(frame.depth_stamp is None for frame in frames)
    kept = next(altered(source).frames(raise_damage))
    assert kept.depth_stamp - kept.stamp == 10 * MILLISECOND


def late(source, milliseconds):
    """Return the ground truth of a source every 5 ms, with stamps that are late."""
    stamps = source.ground_truth.stamps[0] + 5 * MILLISECOND * np.arange(-10, 120)
    return Trajectory(stamps + milliseconds * MILLISECOND,
                      np.array([source.pose(stamp) for stamp in stamps]))


@pytest.mark.parametrize('shift', [-15, 0, 20])
def test_finds_how_late_the_ground_truth_is(registered, source, shift):
    """Pairs by their true poses; those of three frames apart are turned too far by 0.1 deg."""
    stamps = [int(stamp) for stamp in source.ground_truth.stamps]
    pairs = registered.Registered(stamps, {
        (i - gap, i): se3.inverse(source.pose(stamps[i - gap])) @ source.pose(stamps[i])
        @ se3.exp([0, 0, 0, 0, np.radians(0.1) * (gap == 3), 0])
        for gap in (1, 3, 5) for i in range(gap, 16)}, late(source, shift))
    assert pairs.best_shift() == -shift
    assert pairs.shifted()[str(-shift)]['count'] == 11
    loops = pairs.loops()
    assert loops['closing']['count'] == loops['truth_shifted']['count'] == 13
    assert loops['closing']['rotation_median_deg'] == pytest.approx(0.1, rel=1e-6)
    assert loops['truth_shifted']['rotation_median_deg'] == pytest.approx(0.1, rel=1e-3)
    unshifted = loops['truth']['rotation_median_deg']
    assert (abs(unshifted - 0.1) < 1e-3) == (shift == 0)


def test_registers_the_pairs_of_a_source(registered, monkeypatch):
    """Colour and depth taken at once, without noise."""
    source = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=16, camera=SMALL))
    monkeypatch.setattr(source, 'ground_truth', late(source, 20))
    pairs = registered.Registered.of(source)
    assert pairs.best_shift() == -20
    errors = pairs.shifted()
    assert errors['-20']['count'] == 11
    assert errors['-20']['rotation_median_deg'] < 0.015
    assert errors['-20']['translation_median_m'] < 0.001
    loops = pairs.loops()
    assert loops['closing']['count'] == 13
    assert loops['closing']['rotation_median_deg'] < 0.015
    assert loops['closing']['translation_median_m'] < 0.001


@pytest.mark.parametrize(('is_stamped_late', 'least', 'most'), [
    (True, -0.3, 0.3), (False, 0.99, 1.0)])
def test_stamps_that_jitter_do_not_go_with_the_turn(registered, is_stamped_late, least, most):
    """A camera that turns steadily: late stamps of a steady beat, or a beat that is not steady."""
    jitter = 0.003 * np.random.default_rng(1).random(300)
    beat = np.arange(300) / 30
    stamps, taken = beat + jitter, beat if is_stamped_late else beat + jitter
    poses = np.array([se3.exp([0, 0, 0, 0, 0.8 * time, 0]) for time in taken])
    path = Trajectory((1e9 * np.arange(0, 10, 0.01)).astype(np.int64), np.array(
        [se3.exp([0, 0, 0, 0, 0.8 * time, 0]) for time in np.arange(0, 10, 0.01)]))
    figures = registered.Registered(
        [int(1e9 * stamp) for stamp in stamps],
        {(i, i + gap): se3.inverse(poses[i]) @ poses[i + gap]
         for gap in (1, 3, 5) for i in range(300 - gap)}, path).stamps()
    assert figures['interval_ms'] == pytest.approx(1e3 / 30, rel=0.02)
    assert figures['interval_sigma_ms'] == pytest.approx(3 / np.sqrt(6), rel=0.1)
    assert least < figures['correlation'] < most + 1e-9
