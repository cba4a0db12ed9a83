# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is printed of cameras that were drawn at random, and which are named."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from aick_ros.evaluation.scores.consistency import Consistency

FOLDER = Path(__file__).parents[2] / 'benchmarks'


@pytest.fixture(scope='module')
def random_cameras(load):
    return load(FOLDER / 'random_cameras.py')


def scores(nees, lost=0, with_objects=0):
    return SimpleNamespace(lost=lost, with_objects=with_objects, ate=0.0123,
                           consistency=Consistency.of(nees))


def test_a_row_has_counts_error_and_consistency(random_cameras):
    assert random_cameras.cells(scores([1.0, 3.0, 30.0, 2.0], 2, 5)) == '2 | 5 | 12.3 | 9.0 | 0.75'
    assert random_cameras.cells(scores([])) == '0 | 0 | 12.3 | 0.0 | 0.00'


def test_cameras_that_miss_something_are_named(random_cameras):
    found = {3: scores([1.0]), 4: scores([6.0], lost=1), 5: scores([7.0], with_objects=2),
             6: scores([8.0], lost=3)}
    assert list(random_cameras.summary(found)) == [
        'no frame lost: 2 of 4; not 4, 6', 'no objects: 3 of 4; not 5',
        'mean NEES of 2 to 7.5: 2 of 4; not 3, 6', 'median of the mean NEES: 6.5']
