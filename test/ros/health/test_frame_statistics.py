# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Counts of frames, and the level and the sentence made of them."""

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.status import Status
from aick_ros.ros.health.frame_statistics import (
    ANSWERED, DAMAGED, FAILED, LATE, LOST, RECEIVED, UNDER_LOAD, FrameStatistics)
from aick_ros.ros.health.levels import Level, judge

NO_KEYPOINTS = KeypointFrame(0, *(np.empty((0, n), np.float32) for n in (3, 32, 9, 2)))


def update(status=Status.OK, matches=100, total=20.0):
    return OdometryUpdate(
        1, status, f'{matches} matches', np.eye(4), np.eye(6), NO_KEYPOINTS,
        support=matches, timing={'total': total})


class Frames(FrameStatistics):
    """Frames at 30 Hz by a clock of the test's own."""

    def __init__(self):
        self.now = 100.0
        super().__init__(clock=lambda: self.now)

    def pass_by(self, count, status=Status.OK, answered=True, **values):
        for i in range(count):
            self.now += 1 / 30
            self.count(RECEIVED)
            if answered:
                self.answered(update(status, **values), delay_ms=10.0 + i % 2,
                              age_ms=50.0 + i % 2)

    def judged(self, complaint='', paused=False):
        return judge(self.snapshot(), complaint, paused)


@pytest.fixture
def frames():
    return Frames()


def test_rates_shares_and_medians_are_those_of_lately(frames):
    frames.pass_by(900, Status.TOO_FEW_MATCHES, matches=3, total=99.0)
    frames.pass_by(301)
    lately = frames.snapshot()
    assert lately.rate(RECEIVED) == pytest.approx(30, rel=0.01)
    assert lately.share(LOST, ANSWERED) < 0.01
    assert (lately.inliers, lately.timing) == (100, {'total': 20.0})
    assert np.median(lately.delays) == pytest.approx(10.5, abs=0.5)
    assert np.median(lately.ages) == pytest.approx(50.5, abs=0.5)
    assert lately.totals[LOST] == 900
    assert lately.totals[ANSWERED] == 1201


def test_at_the_start_the_rate_is_that_since_then(frames):
    frames.pass_by(60)
    assert frames.snapshot().rate(ANSWERED) == pytest.approx(30, rel=0.05)


def test_counts_from_elsewhere_are_counted_as_they_grow(frames):
    frames.count_up_to(UNDER_LOAD, 5)
    frames.now += 100
    frames.count_up_to(UNDER_LOAD, 7)
    snapshot = frames.snapshot()
    assert (snapshot.totals[UNDER_LOAD], snapshot.recent[UNDER_LOAD]) == (7, 2)


def test_a_stamp_that_repeats_is_no_answer(frames):
    frames.pass_by(3)
    frames.answered(update(Status.BAD_STAMP), 1.0, 1.0)
    snapshot = frames.snapshot()
    assert (snapshot.totals[ANSWERED], snapshot.totals[LATE]) == (3, 1)
    assert snapshot.status is Status.OK


def test_all_is_well(frames):
    frames.pass_by(300)
    assert frames.judged() == (Level.OK, 'registered')


def test_before_the_first_frame_it_waits(frames):
    assert frames.judged() == (Level.WARN, 'no frame yet: waiting for images')


def test_what_is_missing_is_an_error_once_nothing_is_answered_any_more(frames):
    frames.pass_by(30)
    assert frames.judged('no camera_info') == (Level.WARN, 'no camera_info')
    frames.now += 6
    assert frames.judged('no camera_info') == (Level.ERROR, 'no camera_info')


def test_lost_for_long_is_an_error_with_a_remedy(frames):
    frames.pass_by(30)
    frames.pass_by(10, Status.TOO_FEW_KEYPOINTS, matches=0)
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert sentence.startswith('too few keypoints with depth: 0 matches; is the lens covered')
    frames.pass_by(80, Status.TOO_FEW_KEYPOINTS, matches=0)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert sentence.startswith('lost for 3 s: too few keypoints')


def test_what_no_one_need_look_at_for_long_is_forgotten(frames):
    frames.pass_by(100, Status.TOO_FEW_MATCHES)
    frames.damaged('wrong size')
    frames.pass_by(200)
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert sentence == '33% of the frames of the last 10 s were lost'
    frames.pass_by(300)
    assert frames.judged()[0] is Level.OK


def test_damaged_frames_and_those_dropped_are_told(frames):
    frames.pass_by(150)
    for _ in range(50):
        frames.pass_by(1, answered=False)
        frames.damaged('wrong size')
    frames.pass_by(100)
    frames.count(UNDER_LOAD, 100)
    level, sentence = frames.judged()
    assert level is Level.WARN
    assert '17% of the frames of the last 10 s could not be used' in sentence
    assert '25 of 30 frames a second are answered: lower features.max_keypoints' in sentence
    assert frames.snapshot().totals[DAMAGED] == 50


def test_a_defect_of_ours_is_an_error(frames):
    frames.pass_by(30)
    frames.damaged('internal error, see the log', FAILED)
    frames.pass_by(30)
    level, sentence = frames.judged()
    assert level is Level.ERROR
    assert 'report it' in sentence


def test_paused(frames):
    assert frames.judged('nobody publishes', paused=True) == (
        Level.WARN, 'paused: call ~/resume_odom to go on')
