# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Conversion and range checks, and the completeness of all declarations."""

import dataclasses
import math

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import Parameter, hint, parameters, values, with_values

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


@pytest.mark.parametrize('fields, text', [
    ({'minimum': 0.0, 'maximum': 2.5, 'unit': 'm'}, '0 to 2.5 m'), ({}, ''),
    ({'minimum': 1.0}, '1 to inf'), ({'maximum': 3.0, 'unit': 's'}, '-inf to 3 s'),
    ({'unit': 'Hz'}, ''), ({'choices': ('a', 'b')}, "'a', 'b'")])
def test_the_range_has_both_ends_and_the_unit(fields, text):
    kind, default = (str, 'a') if 'choices' in fields else (float, 1.0)
    assert Parameter('name', kind, default, 'A test.', **fields).range_text == text


@pytest.mark.parametrize('value, is_within', [
    (0.5, True), (2.0, True), (0.4999, False), (2.0001, False), (math.inf, False)])
def test_the_ends_of_the_range_are_within(value, is_within):
    number = Parameter('x', float, 1.0, 'A test.', minimum=0.5, maximum=2.0)
    if is_within:
        assert number.convert(value) == value
    else:
        with pytest.raises(InputError, match='is outside 0.5 to 2. Meaning: A test.'):
            number.convert(value)


def test_without_a_range_any_finite_number_will_do():
    number = Parameter('x', float, 1.0, 'A test.')
    assert number.convert(-1e300) == -1e300
    for value in (math.inf, -math.inf, 'nan'):
        with pytest.raises(InputError, match='is outside the finite numbers. Meaning'):
            number.convert(value)


@pytest.mark.parametrize('kind, value, expected', [
    (bool, 'TRUE', True), (bool, 'False', False), (bool, True, True), (int, '7', 7), (int, 7.0, 7),
    (int, '1e2', 100), (float, '-2.5', -2.5), (float, 3, 3.0), (str, 'a', 'a'),
    (tuple, '1, 2 3', (1.0, 2.0, 3.0)), (tuple, [1, '2'], (1.0, 2.0)), (tuple, '', ())])
def test_values_are_converted_to_the_type(kind, value, expected):
    found = Parameter('x', kind, None, 'A test.').convert(value)
    assert (found, type(found)) == (expected, kind)


@pytest.mark.parametrize('kind, value, wanted', [
    (bool, 1, 'true or false'), (bool, 'no', 'true or false'), (int, True, 'a whole number'),
    (int, '7.5', 'a whole number'), (float, 'a', 'a number'), (str, 3, 'text'),
    (tuple, 3, 'a list of numbers'), (tuple, [None], 'a list of numbers'),
    (tuple, [True], 'a list of numbers')])
def test_the_sentence_says_what_a_value_is_not(kind, value, wanted):
    with pytest.raises(InputError) as raised:
        Parameter('some.name', kind, None, 'A test.').convert(value)
    assert str(raised.value) == f'some.name = {value!r} is not {wanted}. Meaning: A test.'


@pytest.mark.parametrize('name, sentence', [
    ('imu.gravty', "no parameter is called 'imu.gravty': did you mean imu.gravity?"),
    ('zzz', "no parameter is called 'zzz': all are listed by aick parameters"),
    (5, 'no parameter is called 5: all are listed by aick parameters')])
def test_an_unknown_name_has_a_hint(name, sentence):
    with pytest.raises(InputError) as raised:
        with_values(Settings(), {name: 1})
    assert str(raised.value) == sentence


def test_the_group_that_was_given_is_unchanged():
    before = Settings()
    changed = with_values(with_values(before, {'aick.alpha': 0.25}), {'aick.iterations': 7})
    assert (changed.aick.alpha, changed.aick.iterations) == (0.25, 7)
    assert before == Settings()


@pytest.mark.parametrize('count', [1, 2, 3, 4])
def test_a_hint_has_three_names_at_most(count):
    known = [f'aick.alpha{i}' for i in range(count)]
    text = hint('aick.alpha', known)
    assert text.startswith('did you mean ') and text.endswith('?')
    names = text[len('did you mean '):-1].split(' or ')
    assert len(names) == min(count, 3) and set(names) <= set(known)


def test_changes_are_a_dictionary():
    with pytest.raises(InputError) as raised:
        with_values(Settings(), [('aick.alpha', 0.5)])
    assert str(raised.value) == ('the changes are of the type list: a dictionary of names and '
                                 'values is required')
