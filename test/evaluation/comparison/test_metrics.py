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
