# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Comparison of runs whose errors are known."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.evaluation.comparison import comparison as comparison_module
from aick_ros.evaluation.comparison.block_bootstrap import replicates_of_means
from aick_ros.evaluation.comparison.comparison import Baseline, Change, Comparison, Verdict
from aick_ros.evaluation.comparison.frame_counts import FrameCounts
from aick_ros.evaluation.comparison.metrics import (
    ATE, COVERAGE, LOST, MEMORY, METRICS, RPE_ROTATION, RPE_TRANSLATION, TIME)
from aick_ros.evaluation.runs.run import Run
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.registration.status import Status

FRAMES = 120
PERIOD = NANOSECONDS // 30
NAMES = [f'recording {number}' for number in range(20)]


def run(name, scale=1.0, seed=0, milliseconds=10.0, lost=(), settings=None, truth=True,
        covariance_scale=1.0):
    """
    Return a run along a line whose increments have random errors of 1 mm and 0.001 rad.

    :param scale: of the errors.
    :param seed: runs of one recording with other seeds have other errors of the same size.
    """
    stamps = PERIOD * np.arange(1, FRAMES + 1)
    true = np.tile(np.eye(4), (FRAMES, 1, 1))
    true[:, 0, 3] = 0.01 * np.arange(FRAMES)
    true[:, 1, 3] = 0.3 * np.sin(0.1 * np.arange(FRAMES))
    rng = np.random.default_rng([seed, *name.encode()])
    errors = 1e-3 * rng.normal(size=(FRAMES, 6))
    pose, records = np.eye(4), []
    for index, stamp in enumerate(stamps):
        increment = None
        if index:
            motion = se3.inverse(true[index - 1]) @ true[index]
            motion[:3, 3] += scale * errors[index, :3]
            motion[:3, :3] = se3.exp_rotation(scale * errors[index, 3:]) @ motion[:3, :3]
            increment = Increment(PoseWithCovariance(motion, covariance_scale * 1e-6 * np.eye(6)),
                                  PERIOD / NANOSECONDS)
            pose = pose @ motion
        status = Status.TOO_FEW_MATCHES if index in lost else Status.OK
        records.append(FrameRecord(int(stamp), status, '', PoseWithCovariance(pose.copy()), 100,
                                   50, {'total': milliseconds}, increment))
    return Run(Path(name), name, records, Trajectory(stamps, true) if truth else None, 100.0,
               settings or {}, {})


def runs(names=NAMES, **how):
    return {name: run(name, **how) for name in names}


@pytest.fixture(scope='module')
def baseline():
    return runs()


def test_identical_runs_have_no_change(baseline):
    comparison = Baseline(baseline).compare(runs())
    assert list(comparison.recordings) == NAMES
    assert list(comparison.total) == list(METRICS)
    for changes in (comparison.total, *comparison.recordings.values()):
        assert all(change.change == change.low == change.high == 0 for change in changes.values())
        assert {change.verdict for change in changes.values()} == {Verdict.CHANCE,
                                                                   Verdict.UNTESTED}
    assert comparison.regressions == []


def test_errors_larger_by_a_tenth_are_found(baseline):
    comparison = Baseline(baseline).compare(runs(scale=1.1))
    for metric in (RPE_TRANSLATION, RPE_ROTATION):
        change = comparison.total[metric]
        assert change.change == pytest.approx(0.1, abs=0.02)
        assert change.low < change.change < change.high
        assert change.verdict is Verdict.WORSE
    assert {RPE_TRANSLATION, RPE_ROTATION, ATE} <= set(comparison.regressions)


def test_a_gain_is_no_regression(baseline):
    comparison = Baseline(runs(scale=1.1)).compare(baseline)
    assert comparison.total[RPE_TRANSLATION].verdict is Verdict.BETTER
    assert RPE_TRANSLATION not in comparison.regressions


def test_other_errors_of_the_same_size_are_within_chance(baseline):
    comparison = Baseline(baseline).compare(runs(seed=1))
    assert comparison.regressions == []
    assert comparison.total[RPE_ROTATION].low < 0 < comparison.total[RPE_ROTATION].high


def test_coverage_is_judged_by_its_distance_from_the_nominal_share():
    # errors as large as their covariance says against a covariance four times too small
    comparison = Baseline(runs()).compare(runs(covariance_scale=0.25))
    assert comparison.total[COVERAGE].baseline < 0.02
    assert comparison.total[COVERAGE].verdict is Verdict.WORSE
    # and a hundred times too large: all inside
    wide = Baseline(runs()).compare(runs(covariance_scale=100.0)).total[COVERAGE]
    assert wide.candidate == pytest.approx(0.05)


def test_lost_frames_time_and_memory():
    name, = NAMES[:1]
    comparison = Baseline({name: run(name)}).compare({
        name: run(name, lost=range(30, 60), milliseconds=20.0)})
    assert comparison.total[LOST].change == pytest.approx(30 / FRAMES)
    time = comparison.total[TIME]
    assert (time.baseline, time.candidate, time.change) == pytest.approx((10.0, 20.0, 1.0))
    assert time.verdict is Verdict.UNTESTED
    assert comparison.total[MEMORY].change == 0


def test_without_ground_truth_there_are_no_errors():
    name, = NAMES[:1]
    comparison = Baseline({name: run(name, truth=False)}).compare({name: run(name, truth=False)})
    assert list(comparison.total) == [LOST, TIME, MEMORY]


def test_one_ground_truth_serves_both_runs():
    name, = NAMES[:1]
    comparison = Baseline({name: run(name, truth=False)}).compare({name: run(name)})
    assert comparison.total[ATE].change == 0


def test_of_two_ground_truths_that_of_the_baseline_serves_both_runs():
    name, = NAMES[:1]
    one, other = run(name), run(name)
    other = dataclasses.replace(other, ground_truth=Trajectory(
        other.ground_truth.stamps, other.ground_truth.poses[::-1].copy()))
    assert Baseline({name: one}).compare({name: other}).total[ATE].change == 0


def test_runs_of_other_recordings_and_settings_are_named():
    comparison = Baseline(runs(NAMES[:2], settings={'a': 1, 'b': 2})).compare(
                              runs(NAMES[1:3], settings={'a': 1, 'b': 3}))
    assert list(comparison.recordings) == NAMES[1:2]
    assert (comparison.only_baseline, comparison.only_candidate) == (NAMES[:1], NAMES[2:3])
    assert comparison.settings == {'b': (2, 3)}


def test_the_baseline_is_scored_once_for_all_candidates(monkeypatch):
    scored = []

    def count(run, ground_truth, values_of=comparison_module.values_of):
        scored.append(run)
        return values_of(run, ground_truth)

    monkeypatch.setattr(comparison_module, 'values_of', count)
    first, candidates = runs(NAMES[:2]), [runs(NAMES[:2], seed=seed) for seed in (1, 2, 3)]
    baseline = Baseline(first)
    found = [baseline.compare(candidate).to_json() for candidate in candidates]
    assert [scored.count(run) for run in first.values()] == [1, 1]
    assert len(scored) == 2 + 6
    assert found == [Baseline(first).compare(candidate).to_json() for candidate in candidates]


def test_a_baseline_without_ground_truth_takes_that_of_each_candidate():
    name = NAMES[0]
    baseline = Baseline({name: run(name, truth=False)})
    assert ATE not in baseline.compare({name: run(name, truth=False)}).total
    assert ATE in baseline.compare({name: run(name)}).total


def timed(name, milliseconds, rate=1):
    """Return a run whose frames took so long, at a rate [Hz]."""
    return Run(Path(name), name, [
        SimpleNamespace(stamp=i * NANOSECONDS // rate, status=Status.OK, timing={'total': value})
        for i, value in enumerate(milliseconds)], None, None, {}, {})


def test_the_interval_is_one_of_99_percent():
    """Of the mean of 400 independent times, by the normal distribution."""
    times = np.random.default_rng(0).normal(10.0, 1.0, 400)
    baseline = Baseline({'a': timed('a', 400 * [10.0])})
    change = baseline.compare({'a': timed('a', times)}).total[TIME]
    assert change.change == pytest.approx(times.mean() / 10.0 - 1.0)
    sigma = times.std() / 10.0 / 400 ** 0.5
    assert change.low - change.change == pytest.approx(-2.576 * sigma, rel=0.12)
    assert change.high - change.change == pytest.approx(2.576 * sigma, rel=0.12)


def test_over_recordings_ratios_are_averaged_geometrically_and_values_are_means():
    first = {'a': timed('a', [10.0] * 40), 'b': timed('b', [20.0] * 40)}
    second = {'a': timed('a', [20.0] * 40), 'b': timed('b', [160.0] * 40)}
    found = Baseline(first).compare(second)
    assert found.recordings['a'][TIME].change == pytest.approx(1.0)
    assert found.recordings['b'][TIME].change == pytest.approx(7.0)
    total = found.total[TIME]
    assert (total.baseline, total.candidate, total.change) == pytest.approx((15, 90, 3))


@pytest.mark.parametrize('count, rate, block', [(90, 30, 60), (40, 5, 10), (9, 0.2, 1), (1, 1, 1)])
def test_blocks_are_two_seconds_long(monkeypatch, count, rate, block):
    blocks = set()

    def spy(series, frames):
        blocks.add(frames)
        return replicates_of_means(series, frames)

    monkeypatch.setattr(comparison_module, 'replicates_of_means', spy)
    one = timed('a', [5.0] * count)
    one.records[:] = [SimpleNamespace(**{**vars(r), 'stamp': round(i * NANOSECONDS / rate)})
                      for i, r in enumerate(one.records)]
    Baseline({'a': one}).compare({'a': one})
    assert blocks == {block}


def test_only_frames_of_both_runs_are_compared():
    long, short = timed('a', [*range(1, 11)]), timed('a', [4.0] * 4)
    change = Baseline({'a': long}).compare({'a': short}).total[TIME]
    assert (change.baseline, change.candidate) == (2.5, 4.0)


def cut(run, frames):
    """Return a run that ended after some frames, or lacks some between."""
    return dataclasses.replace(run, records=run.records[frames])


@pytest.mark.parametrize('frames', [slice(40), slice(70, None), slice(None, None, 2)])
def test_the_same_path_has_the_same_errors_however_long_a_run_is(frames):
    """Aligned over its own frames, each run would have errors of its own at common ones."""
    name = NAMES[0]
    whole, part = run(name), cut(run(name), frames)
    for first, second in ((whole, part), (part, whole)):
        comparison = Baseline({name: first}).compare({name: second})
        assert {ATE, RPE_TRANSLATION, LOST} <= set(comparison.total)
        for metric in METRICS:
            assert comparison.total[metric].change == 0, metric
        alone = Baseline({name: cut(run(name), frames)}).compare({name: cut(run(name), frames)})
        assert comparison.total[ATE] == alone.total[ATE]


@pytest.mark.parametrize('frames, lacking', [
    (slice(None), 0), (slice(40), FRAMES - 40), (slice(None, None, 2), FRAMES // 2)])
def test_a_candidate_that_lacks_frames_is_incomplete(frames, lacking):
    name = NAMES[0]
    whole, part = {name: run(name)}, {name: cut(run(name), frames)}
    found, reverse = Baseline(whole).compare(part), Baseline(part).compare(whole)
    assert found.frames == {name: FrameCounts(FRAMES, FRAMES - lacking, FRAMES - lacking)}
    assert (found.is_incomplete, reverse.is_incomplete) == (lacking > 0, False)
    sentence = f'lacks frames that a has, {lacking} of {FRAMES} of {name}: '
    assert [sentence in text for text in found.one_sided('a', 'b')] == [True] * (lacking > 0)
    assert [sentence in text for text in reverse.one_sided('b', 'a')] == [True] * (lacking > 0)


def test_a_candidate_without_a_recording_is_incomplete():
    few, many = runs(NAMES[:1]), runs(NAMES[:2])
    assert Baseline(many).compare(few).is_incomplete
    assert not Baseline(few).compare(many).is_incomplete
    assert Baseline(few).compare(many).one_sided('a', 'b') == [
        f'a has no run of {NAMES[1]}: not compared']


@pytest.mark.parametrize('count', [1, 2])
def test_a_single_common_frame_has_no_ate(count):
    """Its error after alignment is that of rounding, and changes by any factor."""
    name = NAMES[0]
    total = Baseline({name: run(name)}).compare({
        name: cut(run(name, scale=3.0), slice(count))}).total
    assert (ATE in total) == (count == 2)
    assert total[LOST].change == 0


def test_a_baseline_is_scored_anew_for_candidates_of_other_lengths():
    name = NAMES[0]
    baseline = Baseline({name: run(name)})
    for frames in (slice(None), slice(40), slice(None), slice(80, None)):
        candidate = {name: cut(run(name, scale=2.0), frames)}
        assert baseline.compare(candidate).to_json() == Baseline(
            {name: run(name)}).compare(candidate).to_json()


@pytest.mark.parametrize('change, low, high, verdict', [
    (0.011, 1e-9, 0.1, Verdict.WORSE), (0.01, 1e-9, 0.1, Verdict.CHANCE),
    (0.5, 0.0, 0.9, Verdict.CHANCE), (-0.011, -0.1, -1e-9, Verdict.BETTER),
    (-0.01, -0.1, -1e-9, Verdict.CHANCE), (-0.5, -0.9, 0.0, Verdict.CHANCE)])
def test_a_verdict_needs_more_than_chance_and_more_than_the_tolerance(change, low, high, verdict):
    assert comparison_module._verdict(0.01, change, low, high) is verdict


def test_the_json_has_each_part_under_its_name():
    change = Change(1.0, 2.0, 1.0, 0.5, 1.5, Verdict.WORSE)
    content = {'baseline': 1.0, 'candidate': 2.0, 'change': 1.0, 'low': 0.5, 'high': 1.5,
               'verdict': 'worse'}
    comparison = Comparison({'room': {ATE: change}}, {LOST: change, TIME: change}, ['first'],
                            ['second'], {'a': (1, 2)}, {'room': FrameCounts(5, 4, 3)})
    assert comparison.to_json() == {
        'total': {'lost': content, 'frame_ms': content},
        'recordings': {'room': {'ate_m': content}},
        'only_baseline': ['first'], 'only_candidate': ['second'], 'settings': {'a': [1, 2]},
        'frames': {'room': {'baseline': 5, 'candidate': 4, 'common': 3}}, 'is_incomplete': True,
        'regressions': ['lost', 'frame_ms']}


def test_settings_of_one_run_alone_differ():
    first, second = timed('a', [1.0]), timed('a', [1.0])
    first.settings.update(gone=1, same=None)
    second.settings.update(new=2)
    assert Baseline({'a': first}).compare({'a': second}).settings == {
        'gone': (1, None), 'new': (None, 2)}
