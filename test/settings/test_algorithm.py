# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conditions on several parameters together."""

import re
from pathlib import Path

import pytest
import yaml

from aick_ros.errors import InputError
from aick_ros.settings import (
    AickSettings, FeatureSettings, NodeSettings, RefinementSettings, SensorSettings, Settings)
from aick_ros.settings.parameter import parameters, with_values
from aick_ros.settings.text import parameter_table

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / 'docs' / 'parameters.md').read_text()
CONFIG = (ROOT / 'config' / 'odom_node.yaml').read_text()


def test_an_empty_depth_range_is_rejected():
    with pytest.raises(InputError, match='min_depth = 5 m and sensor.max_depth = 2 m'):
        with_values(Settings(), {'sensor.min_depth': 5, 'sensor.max_depth': 2})
    both = {'sensor.min_depth': 15, 'sensor.max_depth': 20}
    assert with_values(Settings(), both).sensor.min_depth == 15


@pytest.mark.parametrize('shares', [
    (), (0.1,), (0.1, 0.1, 0.1), (0.0, 0.0, 0.0, 1.0), (-0.1, 0.0, 0.0, 0.0), (0.5, 0.5, 0.0, 0.0),
    (0.0, 0.0, 0.6, 0.6), (float('nan'), 0.0, 0.0, 0.0)])
def test_shares_that_leave_nothing_of_the_images_are_rejected(shares):
    with pytest.raises(InputError, match='sensor.roi_ratios = .*: four shares are required'):
        SensorSettings(roi_ratios=shares)
    assert SensorSettings(roi_ratios=(0.5, 0.49, 0.0, 0.9)).roi_ratios[3] == 0.9


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


@pytest.mark.parametrize('group', [Settings, NodeSettings])
def test_the_documentation_lists_every_parameter_as_it_is_declared(group):
    """With name, default, range, unit and description; so does the file of the node."""
    listed = set(PAGE.splitlines())
    assert set(parameter_table(group).splitlines()) <= listed
    text = CONFIG.replace(': []', ': ""')
    shipped = yaml.safe_load(re.sub('(?m)^    #([a-z])', r'    \1', text))
    written = shipped['/**']['ros__parameters']
    for parameter in parameters(group):
        if parameter.default != ():
            value = written[parameter.name]
            assert (tuple(value) if isinstance(value, list) else value) == parameter.default


def test_a_depth_range_has_an_extent():
    assert SensorSettings(min_depth=1.999, max_depth=2.0)
    with pytest.raises(InputError) as raised:
        SensorSettings(min_depth=2.0, max_depth=2.0)
    assert str(raised.value) == ('sensor.min_depth = 2 m and sensor.max_depth = 2 m: the first '
                                 'must be less than the second')


def test_a_value_of_code_is_no_group_and_says_which_it_must_be():
    with pytest.raises(InputError) as raised:
        Settings(sensor=5)
    assert str(raised.value) == 'sensor = 5 is not of SensorSettings'


@pytest.mark.parametrize('mode, count, sought', [
    ('joint', 30, 30), ('keypoints', 50, 40), ('none', 50, 50)])
def test_no_more_keypoints_support_a_pose_than_are_tracked(mode, count, sought):
    assert RefinementSettings(mode=mode, max_tracks=40).sought(count) == sought
