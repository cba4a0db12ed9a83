# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Votes on the true pose and a wrong one of rendered frames."""

import dataclasses
from collections import defaultdict
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration import pose_vote as module
from aick_ros.registration.pose_vote import (
    _DEPTH_MISFIT, _depth_misfits, _grey_misfits, _grey_tolerance, pose_vote)
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import ColourSensor, DepthSensor, SyntheticOptions, SyntheticSource

SENSOR = Settings().sensor
SHIFTED = se3.exp([0.06, 0, 0, 0, 0, 0])
CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)


def look(*frames):
    registrar = Registrar()
    return [registrar.prepare(frame) for frame in frames]


@pytest.fixture(scope='module')
def pair():
    """Return a frame, an earlier one, and the pose of the first in the second."""
    source = SyntheticSource(SyntheticOptions(seed=5, frames=5))
    poses = source.ground_truth.poses
    return source.frame(4), source.frame(0), se3.inverse(poses[0]) @ poses[4]


def test_the_true_pose_has_the_votes_whatever_the_order(pair):
    *frames, truth = pair
    views = look(*frames)
    for wrong in (SHIFTED, se3.exp([0, 0, 0.06, 0, 0, 0]), se3.exp([0, 0, 0, 0, 0.05, 0])):
        vote = pose_vote(*views, truth, truth @ wrong, SENSOR)
        assert vote.first > 0.7
        assert vote.second < 0.02
        assert vote.seen > 0.7
        swapped = pose_vote(*views, truth @ wrong, truth, SENSOR)
        assert (swapped.second, swapped.first) == (vote.first, vote.second)
        assert vote.for_second < 0.03 < 0.97 < swapped.for_second


def test_views_of_many_pixels():
    """More cells than OpenCV samples in one column."""
    camera = Camera(1920, 1080, 1500, 1500, 959.5, 539.5)
    grey = np.random.default_rng(0).integers(0, 255, (1080, 1920), np.uint8)
    frame = RgbdFrame(0, cv2.GaussianBlur(grey, (0, 0), 5), np.full((1080, 1920), 2, np.float32),
                      camera)
    vote = pose_vote(*look(frame, dataclasses.replace(frame, stamp=10 ** 9)), np.eye(4), SHIFTED,
                     SENSOR)
    assert vote.seen > 0.8
    assert vote.first > 0.7 > 0.05 > vote.second


def test_a_pose_beside_itself_has_no_votes(pair):
    *frames, truth = pair
    vote = pose_vote(*look(*frames), truth, truth, SENSOR)
    assert (vote.first, vote.second, vote.for_second) == (0, 0, 0)


def test_another_exposure_is_not_another_pose(pair):
    source, target, truth = pair
    darker = dataclasses.replace(source, colour=(0.8 * source.colour).astype(np.uint8))
    vote = pose_vote(*look(darker, target), truth, truth @ SHIFTED, SENSOR)
    assert vote.for_second < 0.05


@pytest.mark.parametrize('columns', [160, 320, 480])
def test_each_part_of_the_view_votes_for_itself(pair, columns):
    """The left columns are those of the target, as if carried along: there nothing moves."""
    source, target, truth = pair
    colour, depth = source.colour.copy(), source.depth.copy()
    colour[:, :columns], depth[:, :columns] = target.colour[:, :columns], target.depth[:, :columns]
    vote = pose_vote(*look(dataclasses.replace(source, colour=colour, depth=depth), target), truth,
                     np.eye(4), SENSOR)
    assert vote.for_second == pytest.approx(columns / 640, abs=0.12)


def wall(truth, contrast):
    """Return two frames of a flat wall, whose depth does not observe a shift."""
    stains = np.random.default_rng(0).normal(0, 1, (600, 800)).astype(np.float32)
    stains = cv2.GaussianBlur(stains, (0, 0), 6)
    stains *= contrast / stains.std()
    shift = round(truth[0, 3] / 2.0 * CAMERA.fx)
    frames = []
    for i, left in enumerate((60 + shift, 60)):
        grey = np.clip(150 + stains[60:540, left:left + 640], 0, 255).astype(np.uint8)
        rng = np.random.default_rng(i)
        colour = ColourSensor().measure(np.repeat(grey[..., None], 3, 2), 1.0, rng)
        depth = DepthSensor().measure(np.full(grey.shape, 2.0, np.float32), CAMERA, rng)
        frames.append(RgbdFrame(i, colour, depth, CAMERA))
    return look(*frames)


def test_faint_stains_on_a_plain_wall_vote():
    truth = se3.exp([40 / CAMERA.fx * 2.0, 0, 0, 0, 0, 0])
    vote = pose_vote(*wall(truth, contrast=8.0), truth, np.eye(4), SENSOR)
    assert vote.first > 0.5
    assert vote.second < 0.05


def test_a_wall_without_stains_does_not_vote():
    truth = se3.exp([40 / CAMERA.fx * 2.0, 0, 0, 0, 0, 0])
    vote = pose_vote(*wall(truth, contrast=0.0), truth, np.eye(4), SENSOR)
    assert vote.first < 0.02
    assert vote.second < 0.02


def test_the_tolerance_of_brightness_is_that_of_a_displacement_by_two_pixels():
    """On a ramp of a and b grey levels a pixel: three levels, and two pixels along either axis."""
    v, u = np.mgrid[:40, :60].astype(np.uint8)
    tolerance = _grey_tolerance(3 * u + 40 - v)
    assert tolerance.dtype == np.float32
    np.testing.assert_array_equal(tolerance[6:-6, 6:-6], 3.0 + 2.0 * (3.0 + 1.0))


def test_the_tolerance_beside_an_edge_is_that_of_the_edge():
    """The images are smoothed over five pixels, on both sides of it, along either axis."""
    edge = np.where(np.arange(60) < 30, 50, 150).astype(np.uint8) * np.ones((40, 1), np.uint8)
    for tolerance in (_grey_tolerance(edge), _grey_tolerance(np.ascontiguousarray(edge.T)).T):
        wide = np.flatnonzero((tolerance > 10.0).all(axis=0))
        assert wide.tolist() == list(range(25, 35))  # the slope at 29 and 30, and four beside it


def test_frames_without_depth_do_not_vote(pair):
    source, target, truth = pair
    blind = dataclasses.replace(target, depth=np.full_like(target.depth, np.nan))
    for views in (look(source, blind), look(blind, source)):
        vote = pose_vote(*views, truth, np.eye(4), SENSOR)
        assert (vote.first, vote.second, vote.seen) == (0, 0, 0)


@pytest.mark.parametrize('rows, counts', [(1, False), (3, True)])
def test_a_block_that_is_hardly_seen_does_not_vote(pair, rows, counts):
    """Of the six rows of cells of each block so many are seen; three tenths are required."""
    *frames, truth = pair
    view, target = look(*frames)
    row = np.arange(len(view.surface.points)) // view.surface.grid.width
    surface = dataclasses.replace(view.surface, usable=view.surface.usable & (row % 6 < rows))
    vote = pose_vote(dataclasses.replace(view, surface=surface), target, truth, truth @ SHIFTED,
                     SENSOR)
    assert (vote.first > 0.7) == counts
    assert counts or vote.first == vote.second == 0.0


def test_the_exposure_is_that_of_most_of_the_view():
    """Which has changed by 30 %; what is covered by a lamp fits neither pose."""
    before = np.random.default_rng(3).uniform(50.0, 150.0, 100)
    now = 1.3 * before
    now[:40] = 255.0
    misfits = _grey_misfits(before, now, np.full(100, 3.0))
    np.testing.assert_allclose(misfits[40:], 0.0, atol=1e-12)
    np.testing.assert_allclose(misfits[:40], np.minimum(
        ((255.0 - 1.3 * before[:40]) / 3.0) ** 2, 1.0))


@pytest.mark.parametrize('without', [0, 1])
def test_both_frames_need_surfaces(pair, without):
    *frames, truth = pair
    views = look(*frames)
    views[without] = dataclasses.replace(views[without], surface=None)
    with pytest.raises(ValueError, match='^a vote on poses requires the surfaces of both frames$'):
        pose_vote(*views, truth, truth, SENSOR)


@pytest.mark.parametrize('share', [0.5, 0.9, 1.5])
@pytest.mark.parametrize('z', [1.0, 3.0])
def test_the_misfit_of_depth_is_by_the_noise_of_a_plane_seen_aslant(z, share):
    """An error of inverse depth moves a point along its ray by z^2 times it."""
    normal, point = np.array([0.6, 0.0, 0.8]), np.array([0.2, -0.1, 1.0]) * z
    target = SimpleNamespace(normals=normal[None], points=point[None] * 1.0)
    along_ray = share * _DEPTH_MISFIT * float(inverse_depth_sigma(z, SENSOR)) * z
    moved = point * (1 + along_ray)
    found = _depth_misfits(moved[None], target, np.array([0]), SENSOR)
    assert found == pytest.approx(min(share ** 2, 1.0), rel=0.12)


@pytest.mark.parametrize('camera, side', [
    (CAMERA, 6), (Camera(320, 240, 262.5, 262.5, 159.5, 119.5), 12)])
def test_blocks_count_their_own_votes(monkeypatch, camera, side):
    """By a loop over the cells: every second usable one votes, in blocks of 24 by 24 pixels."""
    rng = np.random.default_rng(0)
    width, height = np.multiply((40, 33), side) // 6  # no multiples of a block's side
    usable = rng.random(width * height) < 0.9
    row, column = np.divmod(np.arange(width * height), width)
    usable &= (row >= 2 * side) | (column < 3 * side) | (rng.random(width * height) < 0.3)
    surface = SimpleNamespace(grid=SimpleNamespace(width=width, height=height), usable=usable,
                              points=np.ones((width * height, 3), np.float32))
    frame = SimpleNamespace(surface=surface, grey=np.zeros((480, 640), np.uint8),
                            frame=SimpleNamespace(camera=camera))
    cells = np.flatnonzero(usable)[::2]
    # in each block another share of the votes
    blocks = list(zip((row[cells] // side).tolist(), (column[cells] // side).tolist()))
    shares = {block: rng.choice([0.0, 0.02, 0.12, 0.3, 0.8], 2) / 1.25 for block in set(blocks)}
    draws = rng.random(len(cells))
    lead = np.array([0.51 if draw < shares[block][0] else -0.51 if draw > 1 - shares[block][1]
                     else 0.49 for draw, block in zip(draws, blocks)])
    seen = rng.random(len(cells)) < 0.9
    misfits = iter([np.where(seen, 0.6, np.nan), np.where(rng.random(len(cells)) < 0.95,
                                                          0.6 + lead, np.nan)])
    kept = []

    def given(*_):
        kept.append(next(misfits))
        return kept[-1]

    monkeypatch.setattr(module, '_misfits', given)
    vote = pose_vote(frame, frame, np.eye(4), np.eye(4), SENSOR)
    counts = defaultdict(lambda: np.zeros(3, int))
    for block, first, second in zip(blocks, *kept):
        if np.isfinite(first) and np.isfinite(second):
            counts[block] += 1, second - first > 0.5, first - second > 0.5
    full = [(one, other, count) for count, one, other in counts.values()
            if count >= 0.15 * side ** 2]
    first, second = (sum(bool(a > 2 * b and a > 0.1 * n) for a, b, n in votes) for votes in (
        full, [(b, a, n) for a, b, n in full]))
    assert (vote.first, vote.second) == (first / len(full), second / len(full))
    assert min(first, second) > 3 and len(full) < len(counts)
    assert vote.seen == pytest.approx(np.isfinite(kept[0] + kept[1]).mean())
