# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Comparison of two runs over the same recordings, with what chance alone would do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np

from aick_ros.evaluation.comparison.block_bootstrap import REPLICATES, replicates_of_means
from aick_ros.evaluation.comparison.frame_counts import FrameCounts, missing
from aick_ros.evaluation.comparison.metrics import METRICS, Metric, Values, values_of
from aick_ros.evaluation.runs.run import Run
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

CONFIDENCE = 0.99  # chosen: five metrics are tested at once
BLOCK = 2.0  # chosen: twice the interval of the RPE
"""Length of the blocks of the bootstrap [s]."""


class Verdict(Enum):
    """Meaning of a change; the value is its description for people."""

    BETTER = 'better'
    WORSE = 'worse'
    CHANCE = 'within chance'
    UNTESTED = 'not tested'


@dataclass(frozen=True)
class Change:
    """
    Change of a metric from a baseline to a candidate, on one recording or on all.

    :param baseline: value of the metric; of several recordings their mean.
    :param change: share by which it changed, .1 is 10 % more; the difference of a metric that is
        itself a share. Of several recordings the mean, geometric for ratios.
    :param low: lower end of its 99 % interval.
    :param high: upper end.
    """

    baseline: float
    candidate: float
    change: float
    low: float
    high: float
    verdict: Verdict

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON."""
        return {**self.__dict__, 'verdict': self.verdict.name.lower()}


@dataclass(frozen=True)
class Comparison:
    """
    Changes from a baseline to a candidate.

    :param recordings: name -> changes, of the recordings that both have run.
    :param total: changes over all of them.
    :param only_baseline: recordings that the candidate has not run.
    :param only_candidate: recordings that the baseline has not run.
    :param settings: name -> both values, where they differ.
    :param frames: name -> numbers of frames, of the recordings that both have run.
    """

    recordings: Mapping[str, Mapping[Metric, Change]]
    total: Mapping[Metric, Change]
    only_baseline: Sequence[str]
    only_candidate: Sequence[str]
    settings: Mapping[str, tuple[Any, Any]]
    frames: Mapping[str, FrameCounts] = field(default_factory=dict)

    @property
    def regressions(self) -> list[Metric]:
        """Metrics that became worse over all recordings, beyond chance and tolerance."""
        return [metric for metric, change in self.total.items()
                if change.verdict is Verdict.WORSE]

    @property
    def is_incomplete(self) -> bool:
        """A candidate that lacks a recording or a frame of the baseline."""
        return bool(self.only_baseline) or any(
            counts.lacking for counts in self.frames.values())

    def one_sided(self, baseline: str, candidate: str, most: int | None = None) -> list[str]:
        """
        Return sentences on recordings and frames that only one of the two has.

        :param baseline: what it is called, and the candidate likewise.
        :param most: number of recordings that a sentence names; None: all.
        """
        swapped = {name: counts.swapped for name, counts in self.frames.items()}
        return [*missing(self.frames, self.only_baseline, baseline, candidate, most),
                *missing(swapped, self.only_candidate, candidate, baseline, most)]

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON."""
        return {
            'total': _json(self.total),
            'recordings': {name: _json(changes) for name, changes in self.recordings.items()},
            'only_baseline': list(self.only_baseline),
            'only_candidate': list(self.only_candidate),
            'settings': {name: list(both) for name, both in self.settings.items()},
            'frames': {name: dict(counts.__dict__) for name, counts in self.frames.items()},
            'is_incomplete': self.is_incomplete,
            'regressions': [metric.key for metric in self.regressions]}


@dataclass(frozen=True, eq=False)
class _Sample:
    """Baseline and candidate on one recording: values of the metric, and replicates of them."""

    values: np.ndarray
    replicates: np.ndarray


class Baseline:
    """
    Runs that others are compared with; they are scored once for all that have the same frames.

    :param runs: name of the recording -> its run.
    """

    def __init__(self, runs: Mapping[str, Run]) -> None:
        self.runs = runs
        self._scores: dict[tuple[str, frozenset[int]], Mapping[Metric, Values]] = {}

    def compare(self, candidate: Mapping[str, Run]) -> Comparison:
        """Return the changes to other runs."""
        common = [name for name in self.runs if name in candidate]
        samples = {name: self._samples(name, candidate[name]) for name in common}
        differing: dict[str, tuple[Any, Any]] = {}
        for name in common:
            differing.update(_differing(self.runs[name].settings, candidate[name].settings))
        return Comparison(
            {name: {metric: _change(metric, [sample]) for metric, sample in of_one.items()}
             for name, of_one in samples.items()},
            {metric: _change(metric, chosen) for metric in METRICS
             if (chosen := [s[metric] for s in samples.values() if metric in s])},
            [name for name in self.runs if name not in candidate],
            [name for name in candidate if name not in self.runs], differing,
            {name: FrameCounts.of(_stamps(self.runs[name]), _stamps(candidate[name]))
             for name in common})

    def _samples(self, name: str, candidate: Run) -> dict[Metric, _Sample]:
        """
        Return the metrics that both runs have, at the frames that both have.

        Each trajectory is aligned over these frames alone: errors of the same frames are others
        where it is aligned over more.
        """
        run = self.runs[name]
        common = _stamps(run) & _stamps(candidate)
        first = self._values(name, common, candidate.ground_truth)
        second = values_of(_cut(candidate, common), run.ground_truth or candidate.ground_truth)
        return {metric: sample for metric in METRICS if metric in first and metric in second
                and (sample := _sample(metric, first[metric], second[metric])) is not None}

    def _values(self, name: str, stamps: frozenset[int],
                ground_truth: Trajectory | None) -> Mapping[Metric, Values]:
        """
        Return the values of a run at some of its frames.

        :param ground_truth: where the run has none.
        """
        run = self.runs[name]
        if run.ground_truth is None:  # the scores depend on that of the candidate
            return values_of(_cut(run, stamps), ground_truth)
        if (name, stamps) not in self._scores:
            self._scores[name, stamps] = values_of(_cut(run, stamps), run.ground_truth)
        return self._scores[name, stamps]


def _stamps(run: Run) -> frozenset[int]:
    return frozenset(record.stamp for record in run.records)


def _cut(run: Run, stamps: frozenset[int]) -> Run:
    """Return a run with the frames that have one of some stamps, itself where it has no other."""
    if len(run.records) == len(stamps):
        return run
    return replace(run, records=[record for record in run.records if record.stamp in stamps])


def _sample(metric: Metric, baseline: Values, candidate: Values) -> _Sample | None:
    stamps = sorted(baseline.keys() & candidate.keys())
    if not stamps:
        return None
    series = np.array([[values[stamp] for stamp in stamps] for values in (baseline, candidate)])
    period = np.median(np.diff(stamps)) / NANOSECONDS if len(stamps) > 1 else BLOCK
    return _Sample(metric.of_mean(series.mean(axis=1)), metric.of_mean(
        replicates_of_means(series, max(1, round(BLOCK / period)))))


def _change(metric: Metric, samples: Sequence[_Sample]) -> Change:
    """Return the mean change over recordings."""
    change = float(np.mean([metric.change(*sample.values) for sample in samples]))
    replicates = np.mean([metric.change(*sample.replicates) for sample in samples], axis=0)
    assert replicates.shape == (REPLICATES,)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(replicates, (tail, 1 - tail))
    shares = metric.as_share(change), metric.as_share(low), metric.as_share(high)
    verdict = Verdict.UNTESTED if metric.depends_on_machine else _verdict(
        metric.tolerance, *shares)
    baseline, candidate = np.mean([sample.values for sample in samples], axis=0)
    return Change(float(baseline), float(candidate), *shares, verdict)


def _verdict(tolerance: float, change: float, low: float, high: float) -> Verdict:
    if low > 0 and change > tolerance:
        return Verdict.WORSE
    if high < 0 and change < -tolerance:
        return Verdict.BETTER
    return Verdict.CHANCE


def _differing(baseline: Mapping[str, Any],
               candidate: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    names = dict.fromkeys((*baseline, *candidate))
    return {name: (baseline.get(name), candidate.get(name)) for name in names
            if baseline.get(name) != candidate.get(name)}


def _json(changes: Mapping[Metric, Change]) -> dict[str, Any]:
    return {metric.key: change.to_json() for metric, change in changes.items()}
