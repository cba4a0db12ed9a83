# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conversion and range checks, and the completeness of all declarations."""

import dataclasses

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import parameters, values, with_values

ALL = [*parameters(Settings), *parameters(NodeSettings)]


@pytest.mark.parametrize('parameter', ALL, ids=lambda parameter: parameter.name)
def test_every_parameter_has_a_description_a_range_and_a_valid_default(parameter):
    assert parameter.description.endswith('.')
    assert len(parameter.description) > 10
    assert parameter.convert(parameter.default) == parameter.default
    if parameter.type in (int, float):
        assert parameter.minimum is not None
        assert parameter.maximum is not None


def test_names_are_unique():
    names = [parameter.name for parameter in ALL]
    assert len(set(names)) == len(names)


def test_text_and_numbers_are_accepted():
    changed = with_values(Settings(), {
        'aick.alpha': '0.3', 'aick.iterations': 5, 'features.orb.nfeatures': '500',
        'odometry.max_speed': 2})
    assert changed.aick == dataclasses.replace(Settings().aick, alpha=0.3, iterations=5)
    assert changed.features.orb.nfeatures == 500
    assert changed.odometry.max_speed == 2.0
    assert isinstance(changed.odometry.max_speed, float)


def test_values_and_with_values_are_inverse():
    changed = with_values(Settings(), {'aick.alpha': 0.25, 'sensor.max_depth': 4.0})
    assert with_values(Settings(), values(changed)) == changed


@pytest.mark.parametrize('name, value, sentence', [
    ('aick.alpha', 1.5, r'aick\.alpha = 1\.5 is outside 0 to 1'),
    ('aick.alpha', 'fast', r"aick\.alpha = 'fast' is not a number"),
    ('aick.alpha', float('nan'), 'is outside 0 to 1'),
    ('aick.alpha', True, 'is not a number'),
    ('aick.iterations', 2.5, 'is not a whole number'),
    ('aick.iterations', None, 'is not a whole number'),
    ('aick.vocabulary', 3, 'is not text'),
    ('aick.iterations', 0, 'is outside 1 to 100'),
    ('aick.lambda_e', 11, 'is outside 0.0001 to 10 m'),
    ('features.detector', 'surff', "is none of 'orb'"),
    ('aick.alfa', 0.5, r'did you mean aick\.alpha'),
    ('quality', 5, 'no parameter is called'),
])
def test_error_messages_name_parameter_range_and_unit(name, value, sentence):
    with pytest.raises(InputError, match=sentence):
        with_values(Settings(), {name: value})


def test_one_bad_value_rejects_all_changes():
    with pytest.raises(InputError, match='aick.iterations = 1000'):
        with_values(Settings(), {'aick.alpha': 0.3, 'aick.iterations': 1000})
