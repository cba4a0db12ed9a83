# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentence says why the ground truth covers few frames, and that a sparse one adds errors."""

import numpy as np
import pytest

from aick_ros.cli.output.ground_truth_limits import limits
from aick_ros.geometry.trajectory import Trajectory

MS = 10 ** 6
FRAMES = [1_000 * MS + 7 + i * 33 * MS for i in range(100)]
NO_ATE = ('the ground truth of desk covers fewer than two of the frames that were read, so there '
          'is no ATE: ')


def every(interval, first=990, last=4_990):
    """Return a ground truth with a pose in each interval [ms] from one time to another [ms]."""
    stamps = np.arange(first, last, interval, dtype=np.int64) * MS
    return Trajectory(stamps, np.tile(np.eye(4), (len(stamps), 1, 1)))


@pytest.mark.parametrize('truth, sentence', [
    (every(10), None), (every(50), None),
    (every(100), 'poses of the ground truth of desk are 0.1 s apart: errors and NEES include what '
                 'interpolation between them adds'),
    (every(500), 'poses of the ground truth of desk are 0.5 s apart, and up to 0.15 s are '
                 'interpolated: 0 of 100 frames have errors; record it at 10 Hz or more'),
    (every(10, 90_000, 99_000), NO_ATE + 'check that both have the same clock'),
    (every(500, 90_000, 99_000), NO_ATE + 'check that both have the same clock'),
    (every(5_000, 0, 4_000), NO_ATE + 'check that both have the same clock')])
def test_the_sentence_names_the_cause(truth, sentence):
    assert limits('desk', truth, FRAMES) == sentence


def test_a_gap_around_all_frames_is_one():
    before, after = every(10, 0, 990), every(10, 4_500, 5_500)
    truth = Trajectory(*(np.concatenate([getattr(part, name) for part in (before, after)])
                         for name in ('stamps', 'poses')))
    assert limits('desk', truth, FRAMES) == NO_ATE + 'it has a gap of more than 0.05 s there'


@pytest.mark.parametrize('step', [3, 15])
def test_poses_at_the_frames_need_no_interpolation(step):
    """As where the ground truth has been computed at some of the images."""
    stamps = np.array(FRAMES[::step], np.int64)
    truth = Trajectory(stamps, np.tile(np.eye(4), (len(stamps), 1, 1)))
    assert limits('desk', truth, FRAMES[::step]) is None
    assert ('0.49 s apart, and up to 0.15 s are interpolated: 7 of 100 frames' in str(
        limits('desk', truth, FRAMES))) is (step == 15)


def test_of_one_frame_nobody_expects_an_ate():
    assert limits('desk', every(10, 90_000, 99_000), FRAMES[:1]) is None
