# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs that are interrupted and go on, and figures against those of ``aick evaluate``."""

import json

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.results import Results
from aick_ros.evaluation.benchmark.runner import Plan, run
from aick_ros.evaluation.scores.pair_evaluation import PairEvaluation
from aick_ros.registration.registrar import Registrar
from aick_ros.settings.presets import preset
from aick_ros.sources import open_source, raise_damage

GAPS = (1, 3)


def execute(plan, journal, processes=1, is_stopped=lambda told: False):
    """Run a plan; return what progress was told, and the methods that did not start."""
    told = []
    unusable = run(plan, journal, processes, 30.0, told.append, lambda: is_stopped(told))
    journal.close()
    return told, unusable


def without_times(figures):
    """Return the figures that are the same in each run."""
    if not isinstance(figures, dict):
        return figures
    return {key: without_times(value) for key, value in figures.items()
            if not key.endswith('_ms')}


def test_figures_are_those_of_the_evaluation(recording, aick, tum_path):
    plan, journal = Plan([aick], [recording], GAPS), Journal(None, [recording])
    execute(plan, journal)
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


def test_an_interrupted_run_goes_on(recording, aick, method, tmp_path):
    plan = Plan([aick, method()], [recording], GAPS)
    whole = Journal(None, [recording])
    execute(plan, whole)
    path = tmp_path / 'figures.json.partial'
    first = Journal(path, [recording])
    told, _ = execute(plan, first, is_stopped=lambda told: told[-1] >= 5)
    done = sum(map(len, first.pairs.values()))
    assert 5 <= done < plan.registrations
    path.write_text(path.read_text() + '{"method": "cut o')  # the power went
    second = Journal(path, [recording])
    assert second.pairs == first.pairs
    told, _ = execute(plan, second)
    assert told == list(range(done, plan.registrations + 1))
    assert without_times(json.loads(json.dumps(Results.of(plan, second, {}).to_json()))) == \
        without_times(json.loads(json.dumps(Results.of(plan, whole, {}).to_json())))
    third = Journal(path, [recording])
    assert execute(plan, third)[0] == [plan.registrations]  # nothing is left to do
    third.delete()
    assert not path.exists()


def test_several_at_a_time_find_the_same(recording, aick, method):
    plan = Plan([aick, method()], [recording], GAPS)
    figures = []
    for processes in (1, 2):
        journal = Journal(None, [recording])
        execute(plan, journal, processes)
        figures.append(without_times(Results.of(plan, journal, {}).to_json()['methods']))
    assert figures[0] == figures[1]


def test_the_others_go_on_without_one_that_does_not_start(recording, aick, method):
    plan = Plan([method(factory='misbehaving:broken'), aick], [recording], [1])
    journal = Journal(None, [recording])
    _, unusable = execute(plan, journal)
    assert list(unusable) == ['still']
    results = Results.of(plan, journal, unusable)
    assert list(results.methods) == ['aick-orb-350']
    assert 'libGL' in results.not_run['still']


def test_fewer_pairs_are_taken_evenly_and_for_all_alike(recording):
    pairs = recording.pairs((1, 3), most=3)
    assert [pair.target for pair in pairs if pair.gap == 1] == [0, 3, 6]
    assert [pair.target for pair in pairs if pair.gap == 3] == [0, 2, 4]


@pytest.mark.parametrize(('lines', 'message'), [
    ('{"recordings": {}}\n', 'other recordings'),
    ('HEADER\nnonsense\n', 'line 2 is not a result'),
    ('HEADER\n{"method": "a"}\n', 'line 2 is not a result')])
def test_refuses_what_is_of_another_run(recording, tmp_path, lines, message):
    path = tmp_path / 'x.partial'
    Journal(path, [recording]).close()
    path.write_text(lines.replace('HEADER', path.read_text().strip()))
    with pytest.raises(InputError, match=message):
        Journal(path, [recording])
