# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A row of several runs: counts are added, errors averaged, increments taken together."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def other_views(load):
    return load(FOLDER / 'other_views.py')


def cells_of(row):
    return [cell.strip() for cell in row.strip('|').split('|')]


def test_runs_share_a_row(other_views, monkeypatch):
    runs = {'one': SimpleNamespace(frames=5, lost=1, with_objects=0, ate=0.001, nees=[1.0, 99.0]),
            'other': SimpleNamespace(frames=7, lost=2, with_objects=4, ate=0.004,
                                     nees=[2.0, None, 3.0])}
    monkeypatch.setattr(other_views.RunScores, 'of', lambda frames, truth: runs[frames])
    assert cells_of(other_views.row('desk', 'dark', list(runs), None)) == [
        'desk', 'dark', '12', '3', '4', '2.5', '0.75']


def test_a_rendered_room_has_no_objects(other_views):
    source = SyntheticSource(SyntheticOptions(seed=5, frames=4))
    *counts, ate, inside = cells_of(other_views.row(
        'room', 'none', [list(source.frames())], source.ground_truth))[2:]
    assert counts == ['4', '0', '0'] and 0 < float(ate) < 20 and inside == '1.00'
