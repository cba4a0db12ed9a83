# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Scores of a run against those of ``aick evaluate``."""

import json
import math

import numpy as np
import pytest

from aick_ros.evaluation.baselines.registry import METHODS
from aick_ros.evaluation.benchmark.journal import FrameLine, PairLine, begin
from aick_ros.evaluation.benchmark.measurement import measure
from aick_ros.evaluation.benchmark.plan import Plan
from aick_ros.evaluation.benchmark.results import Results
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.evaluation.scores.pair_evaluation import PairEvaluation
from aick_ros.registration.registrar import Registrar
from aick_ros.settings.presets import preset
from aick_ros.sources import open_source, raise_damage

GAPS = (1, 3)


def test_figures_are_those_of_the_evaluation(recording, aick, tum_path, tmp_path):
    plan = Plan([aick], [recording], GAPS)
    journal = begin(tmp_path / 'journal', [recording])
    measure(plan.jobs(journal.path, tmp_path, math.inf)[0])
    journal.refresh()
    scores = Results.of(plan, journal, {}).methods['aick-orb-350']['rendered'].pairs
    fast = preset('paper-fast')
    registrar, evaluation = Registrar(fast), PairEvaluation(fast, recording.ground_truth, GAPS)
    for frame in open_source(tum_path).frames(raise_damage):
        evaluation.add(registrar.prepare(frame))
    for gap, expected in evaluation.scores().items():
        found = scores[str(gap)]
        assert expected.count == found.count == 8 - gap
        assert found.failed == expected.failed
        assert found.success_ratio == expected.success_ratio
        assert found.translation_median_m == pytest.approx(expected.translation_median_m)
        assert found.rotation_median_deg == pytest.approx(expected.rotation_median_deg)
        assert 0 < found.registration_ms.p50 <= found.registration_ms.p99


def test_scores_of_measurements_made_by_hand(recording, aick, tmp_path):
    """Seven pairs at gap 1, of 1 to 7 mm, two of them failed; frame 7 was not timed."""
    plan = Plan([aick, METHODS['pnp']], [recording], (1, 20))
    journal = begin(tmp_path / 'journal', [recording])
    key = aick.identity, 'rendered'
    for pair in plan.pairs['rendered']:
        failed = {2: (None, 'hung'), 3: (9.0, 'lost'), 4: (4.0, 'lost')}.get(pair.target)
        millimetres = None if failed else 0.001 * pair.source
        journal.add(PairLine(*key, pair, millimetres, millimetres, failed[0] if failed else
                             float(pair.source), failed[1] if failed else ''))
    for frame in range(7):
        journal.add(FrameLine(*key, frame, 10.0 * frame))
    journal.add(FrameLine(*key, 99, 1e6))  # of an earlier run with more pairs
    journal.refresh()
    results = Results.of(plan, journal, {'pnp': 'it is broken'})
    score = results.methods[aick.name]['rendered']
    one, twenty = score.pairs['1'], score.pairs['20']
    assert (one.count, one.failed, twenty.count) == (7, 3, 0)
    assert one.success_ratio == {'0.0033': pytest.approx(2 / 7), '0.01': pytest.approx(4 / 7),
                                 '0.05': pytest.approx(4 / 7)}
    assert one.translation_median_m == pytest.approx(0.007)  # failures are infinite
    assert one.registration_ms.p50 == np.median([1, 2, 9, 4, 6, 7])
    assert score.preparation_ms.p50 == 30.0
    assert score.failures == {'hung': 1, 'lost': 2}
    assert list(results.methods) == list(results.settings) == [aick.name]
    assert results.settings[aick.name] == aick.settings


def test_the_json_has_the_facts_of_recordings_and_machine(recording, aick, tmp_path):
    plan = Plan([aick], [recording], (1, 3))
    results = Results.of(plan, begin(tmp_path / 'journal', [recording]), {aick.name: 'no licence'})
    content = json.loads(json.dumps(results.to_json(), allow_nan=False))
    assert content == {
        'methods': {}, 'settings': {}, 'not_run': {aick.name: 'no licence'}, 'threads': 1,
        'recordings': {'rendered': {'frames': 8, 'period_ms': pytest.approx(33.3, abs=0.1),
                                    'mask': '', 'pairs': {'1': 7, '3': 5}}},
        'machine': machine_facts()}
