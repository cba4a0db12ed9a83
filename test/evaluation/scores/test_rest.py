# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Drift at rest of trajectories with a known one."""

import numpy as np
import pytest

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.rest import RestScore
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

RATE = 10


def run(truth_at, error_at, seconds):
    """Return records and ground truth of functions of the time; errors in the camera's frame."""
    stamps = np.arange(round(seconds * RATE) + 1) * (NANOSECONDS // RATE)
    truth = np.array([truth_at(stamp / NANOSECONDS) for stamp in stamps])
    T_odom_world = se3.exp([3.0, -1.0, 0.5, 0.3, 0.2, 0.1])
    records = [FrameRecord(int(stamp), Status.OK, '', PoseWithCovariance(
        T_odom_world @ pose @ se3.exp(error_at(stamp / NANOSECONDS))), 0, 0, {})
        for stamp, pose in zip(stamps, truth)]
    return records, Trajectory(stamps, truth)


def moved(time):
    """Return a camera that moves for two seconds, rests for ten, and moves for two again."""
    going = min(time, 2.0) + max(time - 12.0, 0.0)
    return se3.exp([0.4 * going, 0.0, 0.0, 0.0, 0.3 * going, 0.0])


def test_a_steady_drift_is_measured_at_rest_alone():
    def error(time):
        return [1e-3 * time, 0.0, 0.0, 0.0, 0.0, np.radians(0.1) * time]

    score = RestScore.of(*run(moved, error, 14))
    assert score.stretches == 1
    assert score.duration_s == pytest.approx(10.0, abs=0.11)
    assert score.translation_mm_per_min == pytest.approx(60.0, rel=1e-3)
    assert score.rotation_deg_per_min == pytest.approx(6.0, rel=1e-3)
    assert score.largest_translation_m == pytest.approx(0.010, rel=0.02)
    assert score.largest_rotation_deg == pytest.approx(1.0, rel=0.02)


def test_an_error_that_returns_is_the_largest_but_no_drift():
    def error(time):
        return [0.004 if 6.0 < time < 7.0 else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]

    score = RestScore.of(*run(moved, error, 14))
    assert score.largest_translation_m == pytest.approx(0.004, rel=1e-6)
    assert score.translation_mm_per_min == pytest.approx(0.0, abs=1e-6)


def test_rests_are_weighted_by_their_duration():
    def stopping(time):
        return se3.exp([max(0.0, min(time - 2.0, 2.0)), 0.0, 0.0, 0.0, 0.0, 0.0])

    def error(time):
        return [0.001 if time > 8.0 else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]

    score = RestScore.of(*run(stopping, error, 12))  # 2 s, and 8 s with 1 mm
    assert score.stretches == 2
    assert score.duration_s == pytest.approx(10.0, abs=0.11)
    assert score.translation_mm_per_min == pytest.approx(6.0, rel=0.02)


@pytest.mark.parametrize('pause', [0.5, 0.9])
def test_a_short_pause_is_no_rest(pause):
    def pausing(time):
        return se3.exp([time if time < 1.0 else max(1.0, time - pause), 0, 0, 0, 0, 0])

    nothing = RestScore(0, 0.0, None, None, None, None)
    assert RestScore.of(*run(pausing, lambda time: np.zeros(6), 3)) == nothing


def test_jitter_of_the_ground_truth_is_still_a_rest_and_creeping_is_none():
    rng = np.random.default_rng(1)
    noise = {}

    def jittering(time):
        noise.setdefault(time, rng.uniform(-4e-4, 4e-4, 6))
        return se3.exp(noise[time])

    assert RestScore.of(*run(jittering, lambda time: np.zeros(6), 5)).stretches == 1
    assert RestScore.of(*run(lambda time: se3.exp([0.004 * time, 0, 0, 0, 0, 0]),
                             lambda time: np.zeros(6), 5)).stretches == 0


def test_without_ground_truth_there_is_no_rest():
    records, _ = run(moved, lambda time: np.zeros(6), 3)
    assert RestScore.of(records, None).stretches == 0
    assert RestScore.of([], None).largest_translation_m is None


@pytest.mark.parametrize('step, is_rest', [
    ([0.0019, 0, 0, 0, 0, 0], True), ([0, 0, 0.0021, 0, 0, 0], False),
    ([0, 0, 0, 0, np.radians(0.19), 0], True), ([0, 0, 0, np.radians(0.21), 0, 0], False)])
def test_a_rest_is_within_two_millimetres_and_a_fifth_of_a_degree(step, is_rest):
    """To and fro every half second, so that neither place is held for a second."""
    score = RestScore.of(*run(lambda time: se3.exp(np.array(step) * (int(2 * time) % 2)),
                              lambda time: np.zeros(6), 4))
    assert (score.stretches, score.duration_s) == ((1, 4.0) if is_rest else (0, 0.0))


@pytest.mark.parametrize('frames, is_rest', [(10, True), (9, False)])
def test_a_rest_is_a_second_long_at_least(frames, is_rest):
    def pausing(time):
        frame = round(time * RATE)
        return se3.exp([0.1 * (min(frame, 5) + max(frame - 5 - frames, 0)), 0, 0, 0, 0, 0])

    score = RestScore.of(*run(pausing, lambda time: np.zeros(6), 4))
    assert (score.stretches, score.duration_s) == ((1, 1.0) if is_rest else (0, 0.0))


def test_drift_is_the_sum_of_all_rests_by_their_time():
    """1 mm and 1 degree in the first two seconds, 3 mm and 2 degrees in the last four."""
    def stopping(time):
        return se3.exp([0 if time < 2.05 else 1.0, 0, 0, 0, 0, 0])

    def error(time):
        share = min(time, 2.0) / 2 if time < 2.05 else (time - 2.1) / 3.9
        size = (0.001, 1.0) if time < 2.05 else (0.003, 2.0)
        return [size[0] * share, 0, 0, 0, 0, np.radians(size[1]) * share]

    score = RestScore.of(*run(stopping, error, 6))
    assert score.stretches == 2
    assert score.duration_s == pytest.approx(2.0 + 3.9)
    assert score.translation_mm_per_min == pytest.approx(4 * 60 / 5.9, rel=1e-3)
    assert score.rotation_deg_per_min == pytest.approx(3 * 60 / 5.9, rel=1e-6)
    assert score.largest_translation_m == pytest.approx(0.003, rel=1e-3)
    assert score.largest_rotation_deg == pytest.approx(2.0)
