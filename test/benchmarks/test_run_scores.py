# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Scores of a run against the path that was rendered."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.registration import dynamic_objects, tracked_keypoints

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def run_scores(load):
    return load(FOLDER / 'run_scores.py')


def test_scores_are_those_of_the_odometry(run_scores, source):
    frames, truth = list(source.frames()), source.ground_truth
    found = run_scores.RunScores.of(frames, truth)
    odometry = Odometry()
    poses = np.array([odometry.register_frame(frame).T_odom_camera for frame in frames])
    estimate, true = poses[:, :3, 3], truth.poses[:, :3, 3]
    u, _, vt = np.linalg.svd((true - true.mean(axis=0)).T @ (estimate - estimate.mean(axis=0)))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    errors = (estimate - estimate.mean(axis=0)) @ turn.T - (true - true.mean(axis=0))
    assert found.ate == pytest.approx(np.sqrt((errors ** 2).sum(axis=1).mean()))
    assert (found.frames, found.lost, found.with_objects, len(found.nees)) == (4, 0, 0, 3)
    assert found.consistency.nees_mean == pytest.approx(np.mean(found.nees))


def test_frames_without_a_pose_are_lost(run_scores, source):
    frames = list(source.frames())
    for frame in frames[2:]:
        frame.colour[:] = 0
        frame.depth[:] = np.nan
    assert run_scores.RunScores.of(frames, source.ground_truth).lost == 2


def test_ground_truth_of_another_time_is_named(run_scores, source):
    truth = source.ground_truth
    later = Trajectory(truth.stamps + 10 ** 12, truth.poses)
    with pytest.raises(SystemExit, match='covers none of the frames'):
        run_scores.RunScores.of(source.frames(), later)


@pytest.mark.parametrize('reason, is_of_objects', [
    ('60 keypoints move by themselves, depth agrees with 30 others', True),
    ('60 keypoints move by themselves, 40% of the view shows another motion', True),
    ('30 keypoints beside what has moved before continue the motion', True),
    ('60 keypoints are on what has moved before', True),
    ('60 keypoints agree with the pose', False), ('', False),
    ('two images were removed', False)])
def test_objects_are_those_that_the_reason_names(run_scores, reason, is_of_objects):
    assert run_scores.has_objects(SimpleNamespace(reason=reason)) == is_of_objects


def test_reasons_have_the_words_that_are_looked_for(run_scores):
    reasons = ''.join(Path(module.__file__).read_text()
                      for module in (dynamic_objects, tracked_keypoints))
    for words in run_scores.OF_OBJECTS:
        assert words in reasons
