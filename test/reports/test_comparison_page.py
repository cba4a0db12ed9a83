# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The page of a comparison: whole, and harmless whatever names are in it."""

import re

import pytest

from aick_ros.evaluation.comparison.comparison import Change, Comparison, Verdict
from aick_ros.evaluation.comparison.metrics import ATE, LOST
from aick_ros.reports.comparison_page import comparison_page

NAME = '<img src=x onerror="alert(1)"> $x$'


@pytest.fixture(scope='module')
def text():
    worse = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    same = Change(0.0, 0.0, 0.0, 0.0, 0.0, Verdict.CHANCE)
    changes = {ATE: worse, LOST: same}
    return comparison_page('a & b', {NAME: Comparison(
        {NAME: changes, 'other': changes}, changes, ['first'], ['second'],
        {'aick.alpha': (0.7, NAME)})})


def test_names_are_text(text):
    assert '<img' not in text
    assert 'a &amp; b' in text
    assert text.count('&lt;img src=x') >= 4


def test_changes_have_units_and_missing_runs_are_named(text):
    assert '<td>0.01 m</td><td>0.012 m</td><td>+20.0 %</td><td>+10.0 % to +30.0 %</td>' in text
    assert '<td>+0.0 pp</td>' in text
    assert 'The candidate has no run of first' in text
    assert 'The baseline has no run of second' in text
    assert text.count('<svg') == 2


def test_nothing_is_fetched(text):
    inside = re.sub(r'xmlns(:\w+)?="[^"]*"|<metadata>.*?</metadata>', '', text, flags=re.DOTALL)
    assert not re.search(r'(src|href)="(?!#)|url\((?!#)|@import', inside)
