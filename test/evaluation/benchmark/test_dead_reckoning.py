# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dead reckoning by a method that knows the truth, or is off by a known amount."""

import numpy as np
import pytest

from aick_ros.evaluation.baselines import Estimate
from aick_ros.evaluation.benchmark.dead_reckoning import reckon, walk
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory

FRAMES = 7
OFF = se3.exp([0.002, 0.0, -0.001, 0.0, 0.003, 0.001])


@pytest.fixture(scope='module')
def source():
    return walk(FRAMES)


@pytest.fixture(scope='module')
def frames(source):
    return [source.frame(index) for index in range(FRAMES)]


class Known:
    """Answers with the truth, each time off by a transform, and not at all at some frames."""

    def __init__(self, truth, off=np.eye(4), silent=()):
        self._truth, self._off, self._silent = truth, off, silent

    def prepare(self, frame):
        return frame.stamp

    def register(self, source, target):
        if source in self._silent:
            return Estimate(None, 'silent')
        poses = [self._truth.at(stamp) for stamp in (target, source)]
        return Estimate(se3.inverse(poses[0]) @ poses[1] @ self._off)


def test_the_truth_leads_to_the_end(source, frames):
    reckoning = reckon(Known(source.ground_truth), frames, source.ground_truth)
    end = reckoning.end
    assert (end.frames, end.failed) == (FRAMES, 0)
    assert end.error_m < 1e-9
    assert end.error_deg < 1e-6
    path = source.ground_truth.poses[:, :3, 3]
    assert end.length_m == pytest.approx(sum(map(np.linalg.norm, np.diff(path, axis=0))))
    np.testing.assert_allclose(reckoning.positions, path, atol=1e-9)


def test_points_lie_where_things_are(source, frames):
    """A Kinect's noise at 1.8 m is half a centimetre; edges may be off by more."""
    reckoning = reckon(Known(source.ground_truth), frames, source.ground_truth)
    apart = np.abs(source.scene.clearance(reckoning.points))
    assert len(reckoning.points) == len(reckoning.colours) > 5000
    assert np.quantile(apart, 0.8) < 0.02


def test_errors_add_up(source, frames):
    end = reckon(Known(source.ground_truth, OFF), frames, source.ground_truth).end
    poses = [source.ground_truth.poses[0]]
    for before, now in zip(source.ground_truth.poses, source.ground_truth.poses[1:]):
        poses.append(poses[-1] @ np.linalg.inv(before) @ now @ OFF)
    error = np.linalg.inv(source.ground_truth.poses[-1]) @ poses[-1]
    assert end.error_m == pytest.approx(np.linalg.norm(error[:3, 3]))
    assert end.error_deg == pytest.approx(np.degrees(np.arccos((np.trace(error[:3, :3]) - 1) / 2)))


def test_who_finds_nothing_stands_still(source, frames):
    silent = [frames[2].stamp, frames[5].stamp]
    reckoning = reckon(Known(source.ground_truth, silent=silent), frames, source.ground_truth)
    assert reckoning.end.failed == 2
    steps = np.linalg.norm(np.diff(reckoning.positions, axis=0), axis=1)
    assert list(np.flatnonzero(steps < 1e-12)) == [1, 4]


CAMERA = Camera(20, 10, 12.0, 16.0, 9.0, 4.0)


def made(stamp, depth):
    """Return a frame whose colour is (row, column, 7)."""
    rows, columns = np.mgrid[:10, :20]
    colour = np.stack([rows, columns, np.full_like(rows, 7)], axis=-1).astype(np.uint8)
    return RgbdFrame(stamp, colour, np.full((10, 20), depth, np.float32), CAMERA)


def test_points_are_the_near_pixels_of_every_fifth_frame_in_the_world():
    """Each fifth pixel in both directions, with its colour; what is farther than 1.8 m is not."""
    poses = np.array([se3.exp([0.1 * i, 0.2, 0.3, 0.1, 0.05 * i, 0.2]) for i in range(7)])
    truth = Trajectory(np.arange(7) * 10 ** 8, poses)
    depths = [1.7, 0.5, 0.5, 0.5, 0.5, 1.2, 0.5]
    frames = [made(int(stamp), depth) for stamp, depth in zip(truth.stamps, depths)]
    frames[5].depth[0, 0], frames[5].depth[0, 5], frames[5].depth[0, 10] = 1.81, np.nan, 0.0
    done = []
    reckoning = reckon(Known(truth), frames, truth, done.append)
    assert done == list(range(1, 8))
    expected, colours = [], []
    for index, skipped in ((0, ()), (5, ((0, 0), (0, 5), (0, 10)))):
        for v in (0, 5):
            for u in (0, 5, 10, 15):
                if (v, u) not in skipped:
                    ray = np.array([(u - 9.0) / 12.0, (v - 4.0) / 16.0, 1.0, 1 / depths[index]])
                    expected.append((poses[index] @ (depths[index] * ray))[:3])
                    colours.append((v, u, 7))
    np.testing.assert_allclose(reckoning.points, expected, atol=1e-6)
    np.testing.assert_array_equal(reckoning.colours, colours)
    np.testing.assert_array_equal(reckoning.true_positions, poses[:, :3, 3])


def test_a_frame_without_truth_is_an_error(source, frames):
    truth = Trajectory(source.ground_truth.stamps[:3], source.ground_truth.poses[:3])
    with pytest.raises(ValueError, match=f'does not cover the stamp {frames[3].stamp}'):
        reckon(Known(source.ground_truth), frames, truth)


@pytest.mark.parametrize('gap, is_covered', [(49, True), (51, False)])
def test_a_frame_in_a_gap_of_the_truth_is_an_error(source, frames, gap, is_covered):
    """As in the evaluation: poses far apart say little of those between them."""
    first, last = frames[0].stamp, frames[-1].stamp
    stamps = np.arange(first, last + 1, 10 ** 7)  # 100 Hz
    before = frames[3].stamp - 1_000_000
    kept = stamps[(stamps <= before) | (stamps >= before + gap * 10 ** 6)]
    stamps = np.unique(np.concatenate([kept, [before, before + gap * 10 ** 6]]))
    truth = Trajectory(stamps, np.array([source.ground_truth.at(int(stamp)) for stamp in stamps]))
    if is_covered:
        assert reckon(Known(truth), frames, truth).end.frames == FRAMES
        return
    with pytest.raises(ValueError, match=f'does not cover the stamp {frames[3].stamp}'):
        reckon(Known(source.ground_truth), frames, truth)


def test_a_frame_is_registered_to_the_one_before(source, frames):
    class Asked(Known):
        def register(self, source_, target):
            asked.append((source_, target))
            return super().register(source_, target)

    asked = []
    reckon(Asked(source.ground_truth), frames, source.ground_truth)
    stamps = [frame.stamp for frame in frames]
    assert asked == list(zip(stamps[1:], stamps))


def test_the_walk_is_that_of_a_person_at_twenty_frames_a_second(source):
    stamps = source.ground_truth.stamps
    assert len(source) == FRAMES
    np.testing.assert_allclose(np.diff([source.frame(i).stamp for i in range(3)]), 5e7, atol=1)
    assert stamps[-1] - stamps[0] >= (FRAMES - 1) * 5e7 - 1
