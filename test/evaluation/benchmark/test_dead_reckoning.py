# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dead reckoning by a method that knows the truth, or is off by a known amount."""

import numpy as np
import pytest

from aick_ros.evaluation.baselines import Estimate
from aick_ros.evaluation.benchmark.dead_reckoning import reckon, walk
from aick_ros.geometry import se3

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
