# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Changes of metrics in closed form, and limits exactly met."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.comparison import metrics
from aick_ros.evaluation.comparison.metrics import (
    COVERAGE, LOST, MEMORY, METRICS, RPE_ROTATION, RPE_TRANSLATION, TIME, values_of)
from aick_ros.evaluation.scores.consistency import QUANTILE_95
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status


def test_a_ratio_and_its_inverse_cancel():
    """Logarithms add up, so that several recordings can be averaged."""
    change = RPE_TRANSLATION.change(np.array([2.0, 4.0]), np.array([4.0, 2.0]))
    np.testing.assert_allclose(change, [np.log(2), -np.log(2)])
    assert RPE_TRANSLATION.as_share(change[0]) == pytest.approx(1.0)
    assert RPE_TRANSLATION.as_share(change[1]) == pytest.approx(-0.5)


def test_a_share_changes_by_its_difference():
    change = LOST.change(np.array([0.25]), np.array([0.2]))
    assert LOST.as_share(change[0]) == pytest.approx(-0.05)


def test_no_error_on_both_sides_is_no_change():
    assert RPE_TRANSLATION.change(np.zeros(1), np.zeros(1)).tolist() == [0.0]
    assert np.isfinite(RPE_TRANSLATION.change(np.zeros(1), np.ones(1))).all()


def test_coverage_is_worse_on_either_side_of_its_nominal_value():
    np.testing.assert_allclose(COVERAGE.of_mean(np.array([0.95, 0.9, 1.0])), [0, 0.05, 0.05])


def test_errors_are_means_of_squares():
    for metric in (RPE_TRANSLATION, RPE_ROTATION, metrics.ATE):
        np.testing.assert_allclose(metric.of_mean(np.array([4.0, 9.0])), [2.0, 3.0])
    for metric in (TIME, MEMORY, LOST):
        assert metric.of_mean(np.array([4.0])).tolist() == [4.0]


def test_what_depends_on_the_machine_is_said_to():
    assert {metric for metric in METRICS if metric.depends_on_machine} == {TIME, MEMORY}
    assert len({metric.key for metric in METRICS}) == len(METRICS)


def record(stamp, status=Status.OK, **timing):
    return SimpleNamespace(stamp=stamp, status=status, timing=timing, increment=stamp)


def run(*records, memory=None):
    return SimpleNamespace(records=records, peak_memory_mb=memory)


def test_values_without_truth_are_those_of_the_records():
    values = values_of(run(record(1, total=5.0), record(2, Status.TOO_FEW_MATCHES, total=7.0),
                           record(3, Status.REPEATED, decode=1.0), memory=80.0), None)
    assert values == {LOST: {1: 0.0, 2: 1.0, 3: 0.0}, TIME: {1: 5.0, 2: 7.0},
                      MEMORY: {1: 80.0, 2: 80.0, 3: 80.0}}
    assert list(values) == [LOST, TIME, MEMORY]


def test_what_a_run_has_no_values_of_is_not_there():
    assert list(values_of(run(record(1)), None)) == [LOST]


def test_an_increment_at_the_quantile_is_inside_and_one_without_nees_is_none(monkeypatch):
    nees = {1: QUANTILE_95, 2: np.nextafter(QUANTILE_95, 99), 3: None, 4: np.inf, 5: 0.0}
    monkeypatch.setattr(metrics, 'compare', lambda estimate, truth: None)
    monkeypatch.setattr(metrics, 'trajectory_of', lambda records: None)
    monkeypatch.setattr(metrics, 'increment_error', lambda stamp, increment, truth: (
        SimpleNamespace(nees=nees[stamp]) if stamp in nees else None))
    values = values_of(run(*map(record, range(1, 7))), 'truth')
    assert values[COVERAGE] == {1: 1.0, 2: 0.0, 4: 0.0, 5: 1.0}


def test_errors_are_those_of_the_score_frame_by_frame():
    rng = np.random.default_rng(0)
    stamps = NANOSECONDS // 10 * np.arange(5, 65)
    true = np.array([se3.exp([0.1 * i, np.sin(0.2 * i), 0, 0, 0.05 * i, 0]) for i in range(60)])
    records = [FrameRecord(int(stamp), Status.OK, '', PoseWithCovariance(
        pose @ se3.exp(rng.normal(0, 0.01, 6))), 1, 1, {}) for stamp, pose in zip(stamps, true)]
    values = values_of(run(*records), Trajectory(stamps, true))
    score = TrajectoryScore.of(records, Trajectory(stamps, true))
    for metric, expected in ((RPE_TRANSLATION, score.rpe_1s_translation_rmse_m),
                             (RPE_ROTATION, score.rpe_1s_rotation_rmse_deg),
                             (metrics.ATE, score.ate_rmse_m)):
        assert metric.of_mean(np.mean(list(values[metric].values()))) == pytest.approx(expected)
    assert list(values[metrics.ATE]) == stamps.tolist()
    assert list(values[RPE_ROTATION]) == list(values[RPE_TRANSLATION]) == stamps[:50].tolist()


def test_keys_and_titles_name_what_is_measured_and_its_unit():
    for metric in METRICS:
        end = metric.key.rpartition('_')[2]
        assert metric.unit.lower() == (end if end in ('m', 'deg', 'ms', 'mb') else '')
        # a title has no word of its own but those for people
        words = {'rpe': 'RPE', 'ate': 'ATE', '1s': '1 s', 'translation': 'translation',
                 'rotation': 'rotation', 'inside': 'inside', '95': '95 %', 'frame': 'frame',
                 'peak': 'peak', 'memory': 'memory'}
        assert all(words[word] in metric.title for word in metric.key.split('_') if word in words)


@pytest.mark.parametrize('metric, tolerance', [
    (RPE_TRANSLATION, 0.01), (COVERAGE, 0.01), (LOST, 0.001)])
def test_shares_change_by_points_and_sizes_by_ratios(metric, tolerance):
    assert metric.is_relative == (metric is RPE_TRANSLATION)
    assert metric.tolerance == tolerance
