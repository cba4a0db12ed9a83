# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""docs/experiments.md: what is on it is what was measured, and it is the page of its results."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from aick_ros.errors import InputError

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / 'benchmarks' / 'experiments'


@pytest.fixture(scope='module')
def write_page(load):
    """Return the script as a module."""
    return load(FOLDER / 'write_page.py')


def pair(ratio, milliseconds, failed=0):
    return {'count': 10, 'failed': failed, 'registration_ms': {'p50': milliseconds, 'p99': 9.0},
            'success_ratio': {'0.0033': ratio / 2, '0.01': ratio, '0.05': 1.0}}


def results(methods, **more):
    """Return results of two recordings and two gaps."""
    names = ('hall', 'room')
    return {
        'date': '2026-01-02', 'figures': {}, 'settings': {name: f'set {name}' for name in methods},
        'machine': {'cpu': 'Abacus', 'cores': 2, 'system': 'Linux', 'python': '3', 'numpy': '2',
                    'opencv': '5', 'aick_ros': '0.1'},
        'recordings': {name: {'frames': 11, 'period_ms': 33.4, 'pairs': {'1': 10, '5': 6}}
                       for name in names},
        'methods': {name: {recording: {
            'pairs': {'1': pair(ratio, time), '5': pair(ratio / 2, time, failed=2)},
            'preparation_ms': {'p50': 7.0, 'p99': 8.0}} for recording, ratio, time in
            zip(names, ratios, times)} for name, (ratios, times) in methods.items()},
        **more}


@pytest.fixture
def page(write_page):
    slow = results({'gicp': ((0.3, 0.2), (5000.0, 7000.0))})
    every = results({'aick-orb': ((0.6, 0.8), (1.0, 1.0))})
    walk = {'corridor': {'frames': 1000, 'length_m': 10.0, 'error_m': 0.25, 'error_deg': 1.5,
                         'failed': 3}}
    return write_page.Page(results({'pnp': ((0.9, 0.8), (20.0, 40.0)),
                                    'aick-orb': ((0.8, 0.7), (10.0, 17.0))}), slow, every, walk)


@pytest.mark.parametrize(('text', 'filled'), [
    ('at {{ratio pnp 5 0.01}}.', 'at 0.45 / 0.40.'),
    ('{{ratio gicp 1 0.0033}}', '0.15 / 0.10'),
    ('{{ms aick-orb}} ms', '10 / 17 ms'),
    ('{{times aick-orb pnp}}', '2.22 x'),
    ('{{times aick-orb pnp whole}}', '1.6 x'),  # (30 + 14) / (13.5 + 14)
    ('{{times aick-orb pnp paper}}', '3.26 x'),  # (30 + 14) / 13.5
    ('{{every aick-orb 1}} of {{trials aick-orb 1}}', '0.70 (0.48 to 0.85) of 20'),
    ('{{recordings}}', 'hall (11 frames, 33 ms apart) and room (11 frames, 33 ms apart)'),
    ('{{corridor}}', '1,000 frames, 10.0 m, off at the end by 0.25 m (2.5 % of the way) and '
                     '1.5 deg, 3 registrations failed'),
    ('{{pairs}} {{pairs slow}}', '10 10')])
def test_figures_are_filled_in(page, text, filled):
    assert page.fill(text) == filled


def test_table_1_has_ours_beside_the_papers(page):
    head, _, first, second = page.fill('{{table 1}}').splitlines()
    assert 'hall | room' in head
    # the paper: 0.135 s; ours: the mean of 10 and 17 ms
    assert first == ('| `aick-orb` | 13.5 | 27.5 | 0.40 / 0.80 / 1.00 | 0.35 / 0.70 / 1.00 | 135 '
                     '| 0.28 / 0.89 / 1.00 | 10 x |')
    assert second.startswith('| `pnp` | 30 | 44 |')


def test_the_gaps_have_a_row_a_method(page):
    rows = [line for line in page.fill('{{table gaps}}').splitlines() if '`pnp`' in line]
    assert rows == ['| `pnp` | 0.90 | 0.45 | 2 | 20 | 7 |', '| `pnp` | 0.80 | 0.40 | 2 | 40 | 7 |']


def test_all_pairs_have_a_row_a_method(page):
    assert page.fill('{{table every}}').splitlines()[2:] == [
        '| `aick-orb` | 0.60 | 0.80 | 0.70 (0.48 to 0.85) | 0.30 | 0.40 | 0.35 (0.18 to 0.57) |']


@pytest.mark.parametrize('successes', [0, 3, 10, 17, 20])
def test_the_interval_of_a_share_is_that_of_scipy(write_page, successes):
    share = write_page.Share(successes, 20)
    expected = binomtest(successes, 20).proportion_ci(method='wilson')
    np.testing.assert_allclose(share.interval, expected, atol=1e-5)


def test_figures_of_two_runs_are_in_the_papers_order(write_page):
    first, second = ({'figures': {number: number + name for number in numbers}}
                     for name, numbers in (('a', ('9', '3')), ('b', ('8-words-orb', '3', '7'))))
    assert list(write_page.all_figures(first, second).values()) == [
        '3a', '7b', '8-words-orbb', '9a']


@pytest.mark.parametrize('text', ['{{ratio icp 1 0.01}}', '{{ratio pnp 7 0.01}}', '{{ratio pnp}}',
                                  '{{speed}}', '{{times aick-orb pnp often}}'])
def test_a_missing_measurement_is_rejected(page, text):
    with pytest.raises(InputError, match=re.escape(text)):
        page.fill(text)


def test_the_page_is_that_of_its_results(write_page):
    assert (ROOT / 'docs' / 'experiments.md').read_text() == write_page.page_text()


def test_its_pictures_are_there():
    pictures = re.findall(r'\]\((\S+\.png)\)', (ROOT / 'docs' / 'experiments.md').read_text())
    assert len(pictures) == len(set(pictures)) > 5
    assert all((ROOT / 'docs' / picture).is_file() for picture in pictures)
