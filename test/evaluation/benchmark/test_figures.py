# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The data of the paper's figures against the same ratios counted by hand."""

import pytest

from aick_ros.evaluation.baselines.registry import METHODS, make
from aick_ros.evaluation.benchmark.figures import Axis, figure_data, paper_figures, variants
from aick_ros.evaluation.benchmark.journal import PairLine, begin
from aick_ros.evaluation.benchmark.plan import Plan
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
    for method, value in zip(methods, shown, strict=True):
        assert f'{value:g}' in method.title.split() or value == shown[-1]


def test_learned_vocabularies_add_two_figures_before_the_last(tmp_path):
    numbers = [figure.number for figure in paper_figures()]
    with_vocabularies = [figure.number for figure in paper_figures(tmp_path)]
    assert with_vocabularies == [*numbers[:-1], '8-words-surf', '8-words-orb', numbers[-1]]
