# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The data of the paper's figures against the same ratios counted by hand."""

import dataclasses

import numpy as np
import pytest

from aick_ros.evaluation.baselines.registry import METHODS, make
from aick_ros.evaluation.benchmark.figures import Axis, figure_data, paper_figures, variants
from aick_ros.evaluation.benchmark.journal import PairLine, begin
from aick_ros.evaluation.benchmark.plan import Plan
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.settings.parameter import values
from aick_ros.settings.presets import preset


@pytest.fixture
def data(recording, aick, tmp_path):
    """Return the data of a run with an error of 4i mm at pair (i, i + gap); pair 0 failed."""
    orb = METHODS['aick-orb']
    plan = Plan([orb, aick], [recording], (1, 4))
    journal = begin(tmp_path / 'journal', [recording])
    for pair in plan.pairs['rendered']:
        error = None if pair.target == 0 else 0.004 * pair.target
        journal.add(PairLine(orb.identity, 'rendered', pair, error, error, 1.0, ''))
    journal.refresh()
    return figure_data(paper_figures(), plan, journal)


def test_success_over_threshold(data):
    curve = data['3']['curves']['aick-orb']['recordings']['rendered']
    assert data['3']['axis'] == 'threshold_m'
    assert (curve['x'][0], curve['x'][-1], len(curve['x'])) == (0.0, 0.05, 51)
    ratios = dict(zip(curve['x'], curve['success_ratio']))
    # errors of 4, 8, .. 24 mm, and one failure, of 7 pairs
    assert [ratios[x] for x in (0.004, 0.005, 0.013, 0.05)] == \
        pytest.approx([0, 1 / 7, 3 / 7, 6 / 7], abs=1e-4)


def test_success_over_gap(data):
    curve = data['4']['curves']['aick-orb']['recordings']['rendered']
    assert curve == {'x': [1, 4], 'success_ratio': [pytest.approx(2 / 7, abs=1e-4), 0.5]}


def test_titles_name_the_axis():
    """Consecutive frames are shown over a threshold, frames farther apart over their distance."""
    titles = {'Consecutive frames': Axis.THRESHOLD, 'consecutive frames': Axis.THRESHOLD,
              'Frames farther apart': Axis.GAP, 'frames farther apart': Axis.GAP}
    found = [(figure.axis, axis) for figure in paper_figures()
             for words, axis in titles.items() if words in figure.title]
    assert len(found) == 7 and all(shown is named for shown, named in found)


def test_unmeasured_figures_are_omitted(data):
    assert '7' not in data
    assert list(data['9']['curves']) == ['aick-orb']


def test_variants_are_the_paper_with_one_setting_changed():
    figures = paper_figures()
    found = variants(figures)
    assert len({method.identity for method in found}) == len(found)
    assert {'aick-orb, aick.iterations=1', 'aick-surf, features.max_keypoints=50',
            'aick-surf-fast, aick.word_radius=0.1'} <= {method.name for method in found}
    for method in found:
        make(method.factory, method.options)  # rejects unknown settings
    assert len({figure.number for figure in figures}) == len(figures)


@pytest.mark.parametrize('number, parameter', [
    ('5', 'features.max_keypoints'), ('6', 'features.max_keypoints'),
    ('6-orb', 'features.max_keypoints'), ('7', 'aick.iterations'), ('8', 'aick.word_radius'),
    ('8-orb', 'aick.word_radius')])
def test_a_series_has_the_papers_own_value_once_and_labels_say_the_values(number, parameter):
    methods = {figure.number: figure.curves for figure in paper_figures()}[number]
    own, = {values(preset(method.options['preset_name']))[parameter] for method in methods}
    shown = [method.options['changes'][parameter] for method in methods]
    assert shown.count(own) == 1 and len(set(shown)) == len(shown) >= 5
    assert shown[:-1] == sorted(shown[:-1])  # the last may have no limit
    for method, value in zip(methods, shown, strict=True):
        assert f'{value:g}' in method.title.split() or value == shown[-1]


def test_learned_vocabularies_add_two_figures_before_the_last(tmp_path):
    numbers = [figure.number for figure in paper_figures()]
    with_vocabularies = [figure.number for figure in paper_figures(tmp_path)]
    assert with_vocabularies == [*numbers[:-1], '8-words-surf', '8-words-orb', numbers[-1]]


def test_curves_and_figures_have_their_names_labels_and_places(data):
    by_number = {figure.number: figure for figure in paper_figures()}
    assert list(data) == [number for number in by_number if number in data]
    for number, content in data.items():
        figure = by_number[number]
        assert (content['title'], content['axis']) == (figure.title, figure.axis.value)
        for name, curve in content['curves'].items():
            assert curve['label'] == METHODS[name].title
    assert set(data) == {'3', '3-today', '4', '4-today', '9'}


def test_the_papers_methods_and_todays_are_figures_of_their_own():
    curves = {figure.number: [method.name for method in figure.curves]
              for figure in paper_figures()}
    assert curves['3'] == curves['4'] and curves['3-today'] == curves['4-today']
    assert curves['3'][:3] == ['aick-orb', 'aick-surf', 'ransac3']
    assert 'aick' in curves['3-today'] and 'aick' not in curves['3']
    assert {name for name in METHODS if name.startswith(('open', 'small', 'pnp'))} <= set(
        curves['3-today'])
    assert {name for name in curves['9'] if 'fast' in name} == {'aick-orb-fast', 'aick-surf-fast'}
    assert all(name.startswith('aick-surf, ') for name in curves['5'] + curves['6'])
    assert all(name.startswith('aick-orb, ') for name in curves['6-orb'] + curves['7'])


def test_the_last_curve_of_a_series_has_no_limit_and_its_label_says_so():
    methods = {figure.number: figure.curves for figure in paper_figures()}
    for number, parameter, value, label in (
            ('5', 'features.max_keypoints', 0, 'all keypoints'),
            ('6-orb', 'features.max_keypoints', 0, 'all keypoints'),
            ('8', 'aick.word_radius', 10.0, 'R_w infinite'),
            ('8-orb', 'aick.word_radius', 10.0, 'R_w infinite')):
        last = methods[number][-1]
        assert (last.options['changes'][parameter], last.title) == (value, label)
    assert [method.title for method in methods['7']][:2] == ['1 iteration', '2 iterations']
    assert [method.title for method in methods['6-orb']][:2] == ['50 keypoints', '100 keypoints']
    assert [method.title for method in methods['8']][0] == 'R_w 0.1'


def test_a_variant_keeps_the_other_changes_of_its_method(monkeypatch):
    base = METHODS['aick-orb']
    changed = dataclasses.replace(base, options={**base.options, 'changes': {'aick.alpha': 0.3}})
    monkeypatch.setitem(METHODS, 'aick-orb', changed)
    for method in {figure.number: figure for figure in paper_figures()}['7'].variants:
        assert method.options['changes']['aick.alpha'] == 0.3
        assert len(method.options['changes']) == 2
    assert changed.options['changes'] == {'aick.alpha': 0.3}


def test_pairs_that_are_not_measured_do_not_count(recording, tmp_path):
    """Of two measured pairs at gap 1 one is at the threshold, which is no success; none at 4."""
    orb = METHODS['aick-orb']
    plan = Plan([orb], [recording], (1, 4))
    journal = begin(tmp_path / 'journal', [recording])
    for pair, error in zip(plan.pairs['rendered'], (0.01, 0.0099)):
        journal.add(PairLine(orb.identity, 'rendered', pair, error, error, 1.0, ''))
    journal.refresh()
    curves = figure_data(paper_figures(), plan, journal)['4']['curves']
    assert curves == {'aick-orb': {'label': orb.title, 'recordings': {
        'rendered': {'x': [1], 'success_ratio': [0.5]}}}}


def test_a_recording_without_consecutive_frames_has_no_points_over_the_threshold(
        recording, tmp_path):
    """Its frames come in turn after 0.1 and 0.2 s, so that only each second interval counts."""
    stamps = np.cumsum([10 ** 8, *3 * [10 ** 8, 2 * 10 ** 8]])
    truth = Trajectory(stamps[0] + 10 ** 7 * np.arange(120), np.tile(np.eye(4), (120, 1, 1)))
    uneven = dataclasses.replace(recording, stamps=tuple(stamps.tolist()), ground_truth=truth)
    orb = METHODS['aick-orb']
    plan = Plan([orb], [uneven], (1, 2))
    assert {pair.gap for pair in plan.pairs['rendered']} == {2}
    journal = begin(tmp_path / 'journal', [uneven])
    for pair in plan.pairs['rendered']:
        journal.add(PairLine(orb.identity, 'rendered', pair, 0.0, 0.0, 1.0, ''))
    journal.refresh()
    data = figure_data(paper_figures(), plan, journal)
    curves = {number: data[number]['curves']['aick-orb']['recordings']['rendered']
              for number in ('3', '4')}
    assert curves == {'3': {'x': [], 'success_ratio': []}, '4': {'x': [2], 'success_ratio': [1.0]}}
