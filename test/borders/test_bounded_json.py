# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Numbers of JSON are finite, and their squares too; no name is given twice."""

import json

import pytest

from aick_ros.borders.bounded_json import bounded_json


@pytest.mark.parametrize('content', [
    None, True, 'NaN', 'größe', [], {}, 0, -5, 10 ** 100, 0.1, -1e100, 1e-320,
    {'a': [1, 2.5, {'b': None}]}])
def test_content_is_that_of_the_standard_library(content):
    found = bounded_json(json.dumps(content))
    assert found == content and type(found) is type(content)


@pytest.mark.parametrize('text', [
    'NaN', 'Infinity', '-Infinity', '1e101', '-1.5e308', '1e999', '1' + 101 * '0', '9' * 5000,
    '{"a": [1, {"b": NaN}]}', '', '{', '1 2', 100_000 * '['])
def test_other_numbers_and_other_text_are_rejected(text):
    with pytest.raises(ValueError):
        bounded_json(text)


@pytest.mark.parametrize('text', ['', ' \n\t'])
def test_empty_text_is_said_to_be_empty(text):
    with pytest.raises(ValueError, match='^it is empty$'):
        bounded_json(text)


def test_a_name_that_is_given_twice_is_rejected():
    with pytest.raises(ValueError, match="^it has 'k' twice: remove one$"):
        bounded_json('[{"width": 1, "k": [1], "d": [], "k": [2]}]')
