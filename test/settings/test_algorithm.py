# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conditions on several parameters together."""

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values


def test_an_empty_depth_range_is_rejected():
    with pytest.raises(InputError, match='min_depth = 5 m and sensor.max_depth = 2 m'):
        with_values(Settings(), {'sensor.min_depth': 5, 'sensor.max_depth': 2})
    both = {'sensor.min_depth': 15, 'sensor.max_depth': 20}
    assert with_values(Settings(), both).sensor.min_depth == 15
