# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""docs/accuracy.md: what is on it is what was measured, and it is the page of its results."""

import re
from pathlib import Path

import pytest

from aick_ros.errors import InputError

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / 'benchmarks' / 'accuracy'
XYZ, RPY = 'freiburg1_xyz_150', 'freiburg1_rpy_100'
SHIFTS = ('-20', '-15', '0')


@pytest.fixture(scope='module')
def write_page(load):
    """Return the script as a module."""
    return load(FOLDER / 'write_page.py')


def variant(ratio, nees=6.0):
    pairs = {gap: {'success_ratio': {'0.0033': ratio / 2, '0.01': share}}
             for gap, share in (('1', ratio), ('5', ratio - .1), ('10', ratio - .2))}
    return {'pairs': pairs, 'nees': [nees],
            'trajectory': {'rpe_1s_translation_rmse_m': .02, 'rpe_1s_rotation_rmse_deg': 1.25,
                           'ate_rmse_m': .0301, 'tracked_fraction': 1.0},
            'consistency': {'nees_mean': nees, 'inside_95': .95},
            'silent_failures': {'reported_good': 250, 'reported_good_but_off': 1}}


def own(ratio, nees=6.0):
    """Return results of a recording."""
    errors = {'translation_median_m': .004, 'rotation_median_deg': .25}
    return {'frames': 150,
            'variants': {'none': variant(ratio - .3), 'joint': variant(ratio, nees)},
            'skips': {'4': {'frames': 25, 'rpe_1s_translation_rmse_m': .05,
                            'rpe_1s_rotation_rmse_deg': 3.5, 'ate_rmse_m': .06,
                            'tracked_fraction': .92}},
            'shifted_truth': {**dict.fromkeys(SHIFTS, errors),
                              '-15': {**errors, 'rotation_median_deg': .125}},
            'loops': dict.fromkeys(('closing', 'truth', 'truth_shifted'), errors),
            'stamps': {'interval_ms': 33.3, 'interval_sigma_ms': 3.0, 'turning': 80,
                       'correlation': None},
            'frame_time': {'share': .4}}


@pytest.fixture
def page(write_page):
    rivals = {'recordings': {'hall': {'pairs': {'1': 10, '5': 7}}, 'room': {'pairs': {'1': 8}}},
              'settings': {'pnp': 'as it comes'}, 'methods': {'pnp': {
                  name: {'pairs': {gap: {'failed': 2, 'success_ratio': {'0.01': ratio}}
                                   for gap in ('1', '5')}}
                  for name, ratio in (('hall', .5), ('room', .25))}}}
    return write_page.Page({XYZ: own(1.0), RPY: own(.9), 'room-1': own(1.0, 9.0)}, rivals)


def rows(page, name):
    return page.fill(f'{{{{table {name}}}}}').splitlines()


def test_what_is_worse_than_the_least_is_bold(page):
    success, *_ = rows(page, 'goals')[2:]
    assert success == ('| success within 10 mm, gap 1 / 5 / 10 '
                       '| 1.00 / 0.90 / 0.80 | 0.98 / 0.88 / 0.58 | 1.00 / 0.95 / 0.75 '
                       '| **0.90** / 0.80 / 0.70 | 0.97 / 0.66 / 0.38 | 0.99 / 0.78 / 0.55 |')


def test_figures_are_judged_as_they_are_shown(page):
    ate = next(row for row in rows(page, 'goals') if 'ATE' in row)
    assert ate == ('| position error (ATE) [m] | 0.030 | 0.030 | 0.018 | 0.030 | 0.045 | 0.028 |')


def test_silent_failures_are_counted_of_500(page):
    silent = next(row for row in rows(page, 'goals') if 'of 500' in row)
    assert silent.split(' | ')[1:4] == ['**2.0**', '1.0', '0.0']


def test_the_nees_of_rendered_rooms_has_two_bounds(page):
    assert rows(page, 'rooms')[-1].endswith('| **9.0** | 4.5 to 7.5 | 5.5 to 6.5 |')
    assert rows(page, 'goals')[-1].endswith('| 6.0 | - | - | 6.0 | - | - |')


def test_counts_what_was_reached(page):
    # of 10 figures a recording: 3.3 mm and silent failures on both, and on rpy success at gap 1
    assert page.fill('{{missed}}').startswith(
        'Of 20 figures with a bound, 15 reach the least that was asked for')


def test_rivals_have_a_row_a_method(page):
    assert page.fill('{{pairs}} pairs') == '10 pairs'
    with pytest.raises(InputError):
        page.fill('{{table rivals}}')  # gap 10 was not run
    assert page._beside_rivals('0.01', '1', '5').splitlines()[2:] == [
        '| `pnp` | 0.50 / 0.50 | 0.25 / 0.25 | 8 |']


def test_all_frames_are_beside_fewer(page):
    assert rows(page, 'skips')[2:4] == [
        f'| {XYZ} | 1 | 150 | 0.020 | 1.25 | 0.030 | 100 % |',
        f'| {XYZ} | 4 | 25 | 0.050 | 3.50 | 0.060 | 92 % |']


@pytest.mark.parametrize(('text', 'filled'), [
    ('{{figure room-1 frame_time share}}', '0.4'),
    ('{{figure room-1 skips 4 tracked_fraction}}', '0.92'),
    ('at {{shift room-1}}.', 'at -15 ms, which takes it from 0.25 to 0.12 deg.')])
def test_single_figures(page, text, filled):
    assert page.fill(text) == filled


@pytest.mark.parametrize('text', ['{{figure hall frame_time share}}', '{{speed}}',
                                  '{{figure room-1 skips 3 tracked_fraction}}'])
def test_a_missing_measurement_is_rejected(page, text):
    with pytest.raises(InputError, match=re.escape(text)):
        page.fill(text)


def test_the_page_is_that_of_its_results(write_page):
    assert (ROOT / 'docs' / 'accuracy.md').read_text() == write_page.page_text()


def test_its_pictures_are_there():
    pictures = re.findall(r'\]\((\S+\.png)\)', (ROOT / 'docs' / 'accuracy.md').read_text())
    assert len(pictures) == len(set(pictures)) == 5
    assert all((ROOT / 'docs' / picture).is_file() for picture in pictures)
