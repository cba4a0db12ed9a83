# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Scores of a run against those of ``aick evaluate``."""

import math

import pytest

from aick_ros.evaluation.benchmark.journal import begin
from aick_ros.evaluation.benchmark.measurement import measure
from aick_ros.evaluation.benchmark.plan import Plan
from aick_ros.evaluation.benchmark.results import Results
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
