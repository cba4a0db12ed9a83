# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs of a plan: interrupted and resumed, in several processes, with unusable methods."""

import json

from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.results import Results
from aick_ros.evaluation.benchmark.runner import Plan

GAPS = (1, 3)


def without_times(figures):
    """Return the figures that are the same in each run."""
    if not isinstance(figures, dict):
        return figures
    return {key: without_times(value) for key, value in figures.items()
            if not key.endswith('_ms')}


def test_an_interrupted_run_goes_on(recording, aick, method, execute, tmp_path):
    plan = Plan([aick, method()], [recording], GAPS)
    whole = Journal(None, [recording])
    execute(plan, whole)
    path = tmp_path / 'figures.json.partial'
    first = Journal(path, [recording])
    execute(plan, first, is_stopped=lambda progress: progress[-1] >= 5)
    done = sum(map(len, first.pairs.values()))
    assert 5 <= done < plan.registrations
    path.write_text(path.read_text() + '{"method": "cut o')  # as after a power failure
    second = Journal(path, [recording])
    assert second.pairs == first.pairs
    progress, _ = execute(plan, second)
    assert progress == list(range(done, plan.registrations + 1))
    assert without_times(json.loads(json.dumps(Results.of(plan, second, {}).to_json()))) == \
        without_times(json.loads(json.dumps(Results.of(plan, whole, {}).to_json())))
    third = Journal(path, [recording])
    assert execute(plan, third)[0] == [plan.registrations]  # nothing is left to do
    third.delete()
    assert not path.exists()


def test_the_number_of_processes_does_not_change_the_figures(recording, aick, method, execute):
    plan = Plan([aick, method()], [recording], GAPS)
    figures = []
    for processes in (1, 2):
        journal = Journal(None, [recording])
        execute(plan, journal, processes)
        figures.append(without_times(Results.of(plan, journal, {}).to_json()['methods']))
    assert figures[0] == figures[1]


def test_the_other_methods_go_on_without_one_that_does_not_start(recording, aick, method, execute):
    plan = Plan([method(factory='misbehaving:broken'), aick], [recording], [1])
    journal = Journal(None, [recording])
    _, unusable = execute(plan, journal)
    assert list(unusable) == ['still']
    results = Results.of(plan, journal, unusable)
    assert list(results.methods) == ['aick-orb-350']
    assert 'libGL' in results.not_run['still']
