# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Scores of a benchmark: Table I of the paper, for each method and recording."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines.registry import Method
from aick_ros.evaluation.benchmark.journal import Journal, PairLine
from aick_ros.evaluation.benchmark.plan import Plan
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.evaluation.scores.pair_evaluation import PairError, PairScore
from aick_ros.evaluation.scores.statistics import Percentiles


@dataclass(frozen=True)
class MethodScore:
    """
    Scores of a method on a recording; the fields are the keys of the JSON.

    :param pairs: gap -> score.
    :param preparation_ms: time of the steps done once per frame.
    :param failures: reason -> number of failed pairs.
    """

    pairs: dict[str, PairScore]
    preparation_ms: Percentiles
    failures: dict[str, int]

    @classmethod
    def of(cls, method: Method, recording: Recording, plan: Plan,
           journal: Journal) -> MethodScore:
        """Return the scores of a method; the journal must have all its pairs."""
        key, pairs = (method.identity, recording.name), plan.pairs[recording.name]
        lines = [journal.pairs[key][pair] for pair in pairs]
        used = {index for pair in pairs for index in pair}
        times = journal.frames.get(key, {})
        return cls(
            pairs={str(gap): _score([line for line in lines if line.pair.gap == gap])
                   for gap in plan.gaps},
            preparation_ms=Percentiles.of(times[index] for index in used if index in times),
            failures=dict(Counter(line.failure for line in lines if line.failure)))


@dataclass(frozen=True)
class Results:
    """
    Results of a benchmark; the fields are keys of the JSON.

    :param methods: name of the method -> name of the recording -> scores.
    :param settings: name of the method -> its settings, in words.
    :param recordings: name -> numbers of frames and pairs, and the mask.
    :param not_run: name of each method that could not be run -> the reason.
    """

    methods: Mapping[str, Mapping[str, MethodScore]]
    settings: Mapping[str, str]
    recordings: Mapping[str, Mapping[str, Any]]
    not_run: Mapping[str, str]

    @classmethod
    def of(cls, plan: Plan, journal: Journal, not_run: Mapping[str, str]) -> Results:
        """Return the results of a complete run."""
        methods = [method for method in plan.methods if method.name not in not_run]
        return cls(
            methods={method.name: {
                recording.name: MethodScore.of(method, recording, plan, journal)
                for recording in plan.recordings} for method in methods},
            settings={method.name: method.settings for method in methods},
            recordings={recording.name: _facts(recording, plan) for recording in plan.recordings},
            not_run=dict(not_run))

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON; a missing value is None."""
        return {**dataclasses.asdict(self), 'threads': 1, 'machine': machine_facts()}


def _score(lines: Sequence[PairLine]) -> PairScore:
    """Return the score of some pairs; times are those of the registrations that ended."""
    errors = [PairError(translation=np.inf if line.translation is None else line.translation,
                        rotation=np.inf if line.rotation is None else line.rotation,
                        milliseconds=0.0 if line.milliseconds is None else line.milliseconds)
              for line in lines]
    measured = [line.milliseconds for line in lines if line.milliseconds is not None]
    return dataclasses.replace(PairScore.of(errors), registration_ms=Percentiles.of(measured))


def _facts(recording: Recording, plan: Plan) -> dict[str, Any]:
    pairs = plan.pairs[recording.name]
    return {'frames': len(recording.stamps), 'period_ms': recording.period / 1e6,
            'mask': recording.request.mask,
            'pairs': {str(gap): sum(pair.gap == gap for pair in pairs) for gap in plan.gaps}}
