# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conditions on several parameters together."""

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import (
    AickSettings, FeatureSettings, NodeSettings, RefinementSettings, Settings)
from aick_ros.settings.parameter import with_values


def test_an_empty_depth_range_is_rejected():
    with pytest.raises(InputError, match='min_depth = 5 m and sensor.max_depth = 2 m'):
        with_values(Settings(), {'sensor.min_depth': 5, 'sensor.max_depth': 2})
    both = {'sensor.min_depth': 15, 'sensor.max_depth': 20}
    assert with_values(Settings(), both).sensor.min_depth == 15


@pytest.mark.parametrize('group, values, sentence', [
    (FeatureSettings, {'max_keypoints': -5}, 'max_keypoints = -5 is outside 0 to 20000'),
    (FeatureSettings, {'detector': 'magic'}, "detector = 'magic' is none of 'orb', 'surf'"),
    (RefinementSettings, {'mode': 'best'}, "mode = 'best' is none of"),
    (AickSettings, {'alpha': float('nan')}, 'alpha = nan is outside'),
    (AickSettings, {'iterations': 10 ** 400}, 'is not a whole number'),
    (AickSettings, {'vocabulary': None}, 'vocabulary = None is not text'),
    (NodeSettings, {'camera_in_base': 3.0}, 'camera_in_base = 3.0 is not a list of numbers'),
    (Settings, {'aick': None}, 'aick = None is not of AickSettings'),
    (Settings, {'aick': FeatureSettings()}, 'is not of AickSettings')])
def test_settings_made_in_code_are_checked(group, values, sentence):
    with pytest.raises(InputError, match=sentence):
        group(**values)


def test_settings_made_in_code_have_their_types():
    assert AickSettings(alpha='0.5').alpha == 0.5
    assert NodeSettings(camera_in_base=[1, 2]).camera_in_base == (1.0, 2.0)
    hash(NodeSettings(camera_in_base=[1, 2]))
