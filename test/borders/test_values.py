# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arguments from a caller's code: what is right is taken, anything else is one sentence."""

import math
import warnings

import numpy as np
import pytest

from aick_ros.borders.values import (
    number, numbers, required, required_array, required_method, whole_number)
from aick_ros.errors import InputError

ODD = [None, 'abc', b'ab', 1 + 2j, [], {}, object(), int, math.nan, np.array([1.0, 2.0]),
       np.zeros(3, complex), np.array([None, 1]), np.array('x'), [[1], [2, 3]], 10 ** 400]


@pytest.mark.parametrize('value', [3, -2.5, np.float32(2.5), np.int64(7), math.inf, True])
def test_numbers_of_any_kind_are_numbers(value):
    assert number(value, 'the speed') == value


@pytest.mark.parametrize('value', ODD, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize('check', [
    lambda value: number(value, 'the speed'), lambda value: whole_number(value, 'the speed'),
    lambda value: numbers(value, (4, 4), 'the speed'),
    lambda value: required(value, range, 'the speed'),
    lambda value: required_method(value, 'detect', 'the speed'),
    lambda value: required_array(value, np.uint8, (4, 4), 'the speed')])
def test_anything_else_is_one_short_sentence(check, value):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with pytest.raises(InputError, match=r'^the speed: .*, where .* is required$') as raised:
            check(value)
    assert len(str(raised.value)) < 250


@pytest.mark.parametrize('value, accepted', [
    (2 ** 63 - 1, True), (-2 ** 63, True), (np.int32(5), True), (2 ** 63, False), (5.0, False)])
def test_whole_numbers_are_those_of_64_bits(value, accepted):
    if accepted:
        assert whole_number(value, 'the stamp') == value
    else:
        with pytest.raises(InputError):
            whole_number(value, 'the stamp')


@pytest.mark.parametrize('values', [
    [[1, 2], [3, 4]], np.array([[1, 2], [3, 4]], np.int8), np.ma.array([[1, 2], [3, 4]]),
    np.array([[1, 2], [3, 4]], '>f8'), np.array([[1, 0, 2, 0], [3, 0, 4, 0]], 'f4')[:, ::2]])
def test_real_numbers_of_any_type_become_those_required(values):
    for kind in (np.float64, np.float32):
        array = numbers(values, (None, 2), 'the matrix', kind)
        assert type(array) is np.ndarray and array.dtype == kind
        np.testing.assert_array_equal(array, [[1, 2], [3, 4]])


def test_an_array_that_is_right_is_not_copied():
    array = np.zeros((3, 2))
    assert numbers(array, (None, 2), 'the matrix') is array


@pytest.mark.parametrize('value, what', [
    (None, 'None'), (True, 'True'), (2.5, '2.5'), ('abc', "'abc'"),
    ((1,), 'an object of the class tuple'),
    (10 ** 30 - 1, str(10 ** 30 - 1)), (10 ** 30, 'a very large number'),
    (-10 ** 30, 'a very large number'), (np.float32(1.5), repr(np.float32(1.5))),
    (np.zeros((3, 2), np.int16), 'an array of int16 of the shape 3x2'),
    (np.zeros(()), 'an array of float64 of the shape ()'),
    (90 * 'x', "'" + 79 * 'x' + '...')])
def test_a_sentence_says_in_a_few_words_what_it_was(value, what):
    with pytest.raises(InputError) as raised:
        required_method(value, 'detect', 'the detector')
    assert str(raised.value) == (
        f'the detector: {what}, where an object with the method detect is required')


@pytest.mark.parametrize('shape, text', [((4, 4), '4x4'), ((None, 3), 'Nx3'), ((), r'\(\)')])
def test_the_shape_that_is_required_is_named(shape, text):
    with pytest.raises(InputError, match=f'shape {text} is required$'):
        required_array(np.zeros((2, 2, 2)), np.float64, shape, 'the matrix')
    with pytest.raises(InputError, match=f'where the shape {text} is required$'):
        numbers(np.zeros((2, 2, 2)), shape, 'the matrix')


@pytest.mark.parametrize('check, sentence', [
    (lambda: required(5, range, 'the way'),
     'the way: 5, where an object of the class range is required'),
    (lambda: required_method({}, 'detect', 'it'),
     'it: an object of the class dict, where an object with the method detect is required'),
    (lambda: number(None, 'the speed'), 'the speed: None, where a number is required'),
    (lambda: number(math.nan, 'the speed'), 'the speed: nan, where a number is required'),
    (lambda: whole_number(2.0, 'the stamp'),
     'the stamp: 2.0, where a 64-bit whole number is required'),
    (lambda: whole_number(10 ** 29, 'it'), f'it: {10 ** 29}, where a 64-bit whole number is '
     'required'),
    (lambda: whole_number(-10 ** 30, 'it'), 'it: a very large number, where a 64-bit whole number '
     'is required'),
    (lambda: numbers('abc', (None, 3), 'points'),
     "points: 'abc', where an array of numbers of the shape Nx3 is required"),
    (lambda: numbers([1.0, 2.0], (None, 3), 'points'),
     'points: an array of float64 of the shape 2, where the shape Nx3 is required'),
    (lambda: numbers(1.0, (4, 4), 'it'),
     'it: an array of float64 of the shape (), where the shape 4x4 is required'),
    (lambda: required_array(np.zeros((2, 3), np.float32), np.uint8, (None, 3), 'it'),
     'it: an array of float32 of the shape 2x3, where an array of uint8 of the shape Nx3 is '
     'required'),
    (lambda: required('x' * 200, int, 'it'),
     f"it: '{'x' * 79}..., where an object of the class int is required")])
def test_the_sentence_says_what_is_there_and_what_should_be(check, sentence):
    with pytest.raises(InputError) as raised:
        check()
    assert str(raised.value) == sentence


@pytest.mark.parametrize('shape, accepted', [
    ((3, 2), True), ((None, 2), True), ((None, None), True), ((2, 3), False), ((3,), False),
    ((3, 2, None), False)])
def test_each_axis_has_its_length(shape, accepted):
    array = np.zeros((3, 2), np.uint8)
    for check in (lambda: required_array(array, np.uint8, shape, 'it'),
                  lambda: numbers(array, shape, 'it')):
        if accepted:
            check()
        else:
            with pytest.raises(InputError):
                check()


def test_what_is_required_is_returned():
    value = range(3)
    assert required(value, range, 'it') is value
    assert required_method(AssertionError(), 'with_traceback', 'it') is None


@pytest.mark.parametrize('length, shown', [
    (78, "'" + 78 * 'x' + "'"), (79, "'" + 79 * 'x' + '...')])
def test_more_than_80_characters_are_cut(length, shown):
    with pytest.raises(InputError) as raised:
        required(length * 'x', int, 'it')
    assert str(raised.value) == f'it: {shown}, where an object of the class int is required'
