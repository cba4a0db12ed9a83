# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Counts, rates and delays of frames."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count

FRAME = SimpleNamespace(keypoints=(), repeat=Repeat.NONE)


def test_rates_shares_and_medians_are_those_of_the_window(frames):
    frames.answer(900, Status.TOO_FEW_MATCHES, matches=3, total=99.0)
    frames.answer(301)
    snapshot = frames.snapshot()
    assert snapshot.rate(Count.RECEIVED) == pytest.approx(30, rel=0.01)
    assert snapshot.share(Count.LOST, Count.ANSWERED) < 0.01
    assert (snapshot.inliers, snapshot.timing) == (100, {'total': 20.0})
    assert np.median(snapshot.delays) == pytest.approx(10.5, abs=0.5)
    assert np.median(snapshot.ages) == pytest.approx(50.5, abs=0.5)
    assert snapshot.totals[Count.LOST] == 900
    assert snapshot.totals[Count.ANSWERED] == 1201


def test_a_rate_in_the_first_seconds_is_that_since_the_start(frames):
    frames.answer(60)
    assert frames.snapshot().rate(Count.ANSWERED) == pytest.approx(30, rel=0.05)


def test_counts_from_elsewhere_enter_the_window_as_they_grow(frames):
    frames.count_up_to(Count.DROPPED_UNDER_LOAD, 5)
    frames.now += 100
    frames.count_up_to(Count.DROPPED_UNDER_LOAD, 7)
    snapshot = frames.snapshot()
    assert snapshot.totals[Count.DROPPED_UNDER_LOAD] == 7
    assert snapshot.recent[Count.DROPPED_UNDER_LOAD] == 2


def test_a_frame_whose_stamp_is_not_newer_is_no_answer(frames):
    frames.answer(3)
    frames.answer(1, Status.BAD_STAMP)
    snapshot = frames.snapshot()
    assert (snapshot.totals[Count.ANSWERED], snapshot.totals[Count.STAMP_NOT_NEWER]) == (3, 1)
    assert snapshot.status is Status.OK
    assert snapshot.silent_for == pytest.approx(1 / 30)


def test_a_lost_camera_is_not_silent(frames):
    """Frames of a lost camera are answered, too."""
    frames.answer(30)
    frames.answer(300, Status.TOO_FEW_MATCHES)
    frames.now += 1.0
    snapshot = frames.snapshot()
    assert snapshot.silent_for == pytest.approx(1.0)
    assert snapshot.lost_for == pytest.approx(11.0)


def test_silence_before_the_first_answer_counts_from_the_start(frames):
    frames.now += 3.0
    assert frames.snapshot().silent_for == pytest.approx(3.0)


def test_a_damaged_frame_does_not_end_a_loss(frames):
    frames.answer(30)
    frames.answer(60, Status.TOO_FEW_MATCHES)
    frames.damage(1)
    assert frames.snapshot().lost_for == pytest.approx(61 / 30)
    frames.answer(1)
    assert frames.snapshot().lost_for == 0.0


def test_a_damaged_frame_does_not_lose_a_tracked_camera(frames):
    frames.answer(30)
    frames.damage(30)
    assert frames.snapshot().lost_for == 0.0


def test_restarted_it_knows_nothing_of_before(frames):
    frames.answer(30)
    frames.answer(60, Status.TOO_FEW_MATCHES)
    frames.now += 100.0
    frames.restart()
    frames.now += 2.0
    snapshot = frames.snapshot()
    assert not snapshot.totals
    assert (snapshot.status, snapshot.lost_for) == (Status.NO_FRAME, 0.0)
    assert snapshot.silent_for == pytest.approx(2.0)
    assert len(snapshot.delays) == 0


def test_what_is_older_than_the_window_does_not_count(frames):
    """What is exactly as old does."""
    frames.count(Count.RECEIVED, 3)
    frames.answer(1, total=5.0)
    frames.now = 120.0
    frames.answer(1, total=9.0)
    frames.now = 130.0 + 1 / 30
    snapshot = frames.snapshot()
    assert (snapshot.recent[Count.RECEIVED], snapshot.recent[Count.ANSWERED]) == (1, 1)
    assert (len(snapshot.delays), len(snapshot.ages), snapshot.timing) == (1, 1, {'total': 9.0})
    frames.now += 0.001
    snapshot = frames.snapshot()
    assert not any(snapshot.recent.values())
    assert (len(snapshot.delays), snapshot.timing, snapshot.inliers) == (0, {}, 0.0)
    assert (snapshot.totals[Count.RECEIVED], snapshot.totals[Count.ANSWERED]) == (5, 2)
    assert snapshot.rate(Count.ANSWERED) == 0.0


@pytest.mark.parametrize('seconds, span', [(0.0, 1e-3), (4.0, 4.0), (10.0, 10.0), (25.0, 10.0)])
def test_a_rate_is_by_the_time_since_the_start_up_to_the_window(frames, seconds, span):
    frames.now += seconds
    frames.count(Count.RECEIVED, 6)
    snapshot = frames.snapshot()
    assert snapshot.span == pytest.approx(span)
    assert snapshot.rate(Count.RECEIVED) == pytest.approx(6 / span)


def test_a_share_is_of_the_other_count_and_none_of_nothing(frames):
    frames.count(Count.LOST, 1)
    frames.count(Count.RECEIVED, 4)
    snapshot = frames.snapshot()
    assert snapshot.share(Count.LOST, Count.RECEIVED) == 0.25
    assert snapshot.share(Count.FAILED, Count.ANSWERED) == 0.0


def test_a_snapshot_stays_as_it_was(frames):
    frames.answer(3)
    before = frames.snapshot()
    frames.answer(4)
    assert (before.totals[Count.ANSWERED], before.recent[Count.ANSWERED]) == (3, 3)


def test_the_status_is_that_of_the_last_frame(frames):
    assert (frames.snapshot().status, frames.snapshot().reason) == (
        Status.NO_FRAME, 'waiting for images')
    frames.answer(1, Status.TOO_FEW_MATCHES, matches=3)
    assert (frames.snapshot().status, frames.snapshot().reason) == (
        Status.TOO_FEW_MATCHES, '3 matches')
    frames.damage(1)
    snapshot = frames.snapshot()
    assert (snapshot.status, snapshot.reason) == (Status.BAD_FRAME, 'wrong size')
    assert (snapshot.totals[Count.DAMAGED], snapshot.totals[Count.FAILED]) == (1, 0)
    frames.damaged('of ours', Count.FAILED)
    snapshot = frames.snapshot()
    assert (snapshot.totals[Count.DAMAGED], snapshot.totals[Count.FAILED]) == (1, 1)


def test_a_loss_lasts_from_the_last_tracked_frame(frames):
    frames.answer(3)
    frames.now += 2.0
    frames.answer(1, Status.TOO_FEW_MATCHES)
    assert frames.snapshot().lost_for == pytest.approx(2.0 + 1 / 30)
    frames.answer(1)
    frames.now += 2.0
    assert frames.snapshot().lost_for == 0.0


def test_the_median_of_a_stage_is_of_the_frames_that_have_it(frames):
    for timing in ({'total': 1.0}, {'total': 3.0, 'depth': 7.0}, {'total': 8.0}):
        frames.answered(OdometryUpdate(
            1, Status.OK, '', PoseWithCovariance.identity(), FRAME, timing=timing), 0.0, 0.0)
    assert frames.snapshot().timing == {'total': 3.0, 'depth': 7.0}


def test_delays_and_ages_are_not_exchanged(frames):
    frames.answer(2)
    snapshot = frames.snapshot()
    assert (snapshot.delays.tolist(), snapshot.ages.tolist()) == ([10.0, 11.0], [50.0, 51.0])


def test_a_flood_of_events_is_bounded(frames):
    for _ in range(20_001):
        frames.count(Count.IMAGES_REJECTED)
    snapshot = frames.snapshot()
    assert snapshot.totals[Count.IMAGES_REJECTED] == 20_001
    assert snapshot.recent[Count.IMAGES_REJECTED] == 10_000


def test_frames_by_one_sensor_alone_and_with_an_image_that_repeats_are_counted(frames):
    frames.answer(2, evidence=Evidence.DEPTH_ALONE)
    frames.answer(3, frame=SimpleNamespace(keypoints=(), repeat=Repeat.DEPTH))
    frames.answer(4)
    frames.answer(5, evidence=Evidence.COLOUR_ALONE)
    totals = frames.snapshot().totals
    assert (totals[Count.BY_DEPTH_ALONE], totals[Count.BY_COLOUR_ALONE],
            totals[Count.REPEATED], totals[Count.ANSWERED]) == (2, 5, 3, 14)


def test_frames_dropped_while_transforms_are_late_are_none_dropped_under_load(frames):
    for total, while_waiting in ((3, False), (10, True), (10, True), (14, False), (15, True)):
        frames.dropped(total, while_waiting)
    totals = frames.snapshot().totals
    assert totals[Count.DROPPED_UNDER_LOAD] == 7
    assert totals[Count.DROPPED_WHILE_WAITING] == 8
