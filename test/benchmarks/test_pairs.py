# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of frames suffer nothing from what is learned of the camera meanwhile."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def pairs(load):
    return load(FOLDER / 'pairs.py')


def test_what_is_learned_loses_no_pairs_of_a_rolling_shutter(pairs, tum_folder):
    shares = pairs.shares_of(str(tum_folder('freiburg1_rpy_100')), 100)
    assert shares.losses == []
    assert shares.learning[1] > 0.9


def test_a_loss_is_named_by_its_gap(pairs):
    shares = pairs.Shares({1: 0.66, 5: 0.55}, {1: 0.97, 5: 0.6})
    assert shares.losses == ['gap 1: 0.97 -> 0.66']
    assert shares.row('a') == ('a', '0.66 / 0.55', '0.97 / 0.60')
