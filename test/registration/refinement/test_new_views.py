# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which registrations are of a camera that has moved."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.new_views import NewViews

OFF = se3.exp([0.09, 0, 0, 0, 0.1, 0])


@pytest.mark.parametrize('step, is_new', [
    ([0.0045, 0, 0, 0, 0, 0], False), ([0, 0.0055, 0, 0, 0, 0], True),
    ([0, 0, 0, 0.004, 0, 0], False), ([0, 0, 0, 0, 0, 0.0048], True)])
def test_a_step_of_5_mm_or_a_quarter_of_a_degree_makes_a_view_new(step, is_new):
    views = NewViews()
    assert views.add(7, OFF)
    for count in range(1, 20):
        assert views.add(7, OFF @ se3.exp(np.array(step) * (count % 2))) == is_new


def test_another_target_makes_a_view_new():
    views = NewViews()
    assert [views.add(target, OFF) for target in (7, 8, 8, 7, 7)] == [
        True, True, False, True, False]


def test_slow_motion_adds_up_until_a_view_is_new():
    """Each step is far below what counts; the last new view is what they are compared with."""
    views = NewViews()
    new = [views.add(7, OFF @ se3.exp([0.0012 * count, 0, 0, 0, 0, 0])) for count in range(17)]
    assert np.diff(np.flatnonzero(new)).tolist() == [5, 5, 5]
    assert new[0]
