# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""YAML is parsed as PyYAML does it, within limits."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from aick_ros.borders.limits import MAX_YAML_DEPTH, MAX_YAML_VALUES
from aick_ros.borders.yaml_text import parse_parameters, parse_yaml
from aick_ros.errors import InputError

BOMB = 'a0: &a0 [x, x]\n' + ''.join(
    f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 9)}]\n' for i in range(1, 12))


@pytest.mark.parametrize('text, reason', [
    (BOMB, f'^it has more than {MAX_YAML_VALUES} values$'),
    ('&a [*a]', '^it has an alias to itself$'), ('&a {b: *a}', 'an alias to itself'),
    ('[' * 900 + ']' * 900, f'^it is nested deeper than {MAX_YAML_DEPTH} levels$'),
    ('[' * 100_000, 'deeper'), ('- ' * 900, 'deeper'),
    ('a: ' + '9' * 5000, 'it is not YAML'), ('2001-99-99', 'it is not YAML'),
    ('!!bool maybe', "^it is not YAML: a value is not of its type .'maybe'.$"),
    ('!!int ""', 'it is not YAML'),
    ('a: [', '^it is not YAML: while parsing a flow node [^"]* in line 1, column 5'),
    ('a: *b', 'it is not YAML'), ('[a]: b', 'it is not YAML'),
    ('a: 1\nb: 2\na: 1', "^it has 'a' twice, in lines 1 and 3: remove one$"),
    ('- {a: {b: 1, "b": 2}}', "it has 'b' twice, in lines 1 and 1"),
    ('!!python/object:os.system {}', 'it is not YAML'), ('\x00', 'it is not YAML')])
def test_what_is_no_yaml_or_too_large_is_rejected(text, reason):
    with pytest.raises(InputError, match=reason):
        parse_yaml(text)


@pytest.mark.parametrize('text, content', [
    ('', None), ('# nothing', None), ('a: &a [1, 2]\nb: *a', {'a': [1, 2], 'b': [1, 2]}),
    ('a: 1\n---\nb: 2', {'a': 1}), ('[' * MAX_YAML_DEPTH + ']' * MAX_YAML_DEPTH, ...),
    ('a: 1\n---\n' + '[' * 900, ...), ('{a: 1, b: {a: 1}}', {'a': 1, 'b': {'a': 1}}),
    ('{1: a, "1": b}', {1: 'a', '1': 'b'})])
def test_the_first_document_is_returned(text, content):
    parsed = parse_yaml(text)
    assert content is ... or parsed == content


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text() | st.floats(allow_nan=False),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20)


@given(VALUES)
def test_what_yaml_writes_is_read_back(content):
    assert parse_yaml(yaml.safe_dump(content)) == content


@given(st.text() | st.text('[]{}:-*&!|>?"\' \n\t,a1', max_size=200))
def test_any_text_is_a_value_or_an_input_error(text):
    try:
        parse_yaml(text)
    except InputError:
        pass


def test_the_list_itself_is_one_of_the_values(monkeypatch):
    monkeypatch.setattr('aick_ros.borders.yaml_text.MAX_YAML_VALUES', 1000)
    assert parse_yaml('[' + '1,' * 999 + ']') == [1] * 999
    with pytest.raises(InputError, match='more than 1000 values'):
        parse_yaml('[' + '1,' * 1000 + ']')


def test_nesting_ends_with_each_level():
    """Depth is that of what is open at a time, also beside other levels."""
    deepest = '[' * (MAX_YAML_DEPTH - 1) + ']' * (MAX_YAML_DEPTH - 1)
    parse_yaml(f'[{deepest}, {deepest}, {{a: 1}}]')
    with pytest.raises(InputError, match='deeper than 32 levels'):
        parse_yaml(f'[[{deepest}]]')


@pytest.mark.parametrize('text, value', [
    ('null', 'null'), ('Null', 'Null'), ('~', '~'), ('nowhere', 'nowhere'),
    ('2001-01-01', '2001-01-01'), ("'null'", 'null'), ('[null, a]', ['null', 'a']),
    ('""', ''), ('', None), ('yes', True), ('off', False), ('010', 8), ('1.5', 1.5)])
def test_parameters_are_read_as_ros_reads_them(text, value):
    """Compared with rclpy 7.1, which gives no value for none."""
    assert parse_parameters(f'a: {text}') == {'a': value}


def test_only_in_parameters_null_is_a_word():
    assert parse_yaml('a: null') == {'a': None}
    with pytest.raises(InputError, match='it has more than'):
        parse_parameters(BOMB)


@pytest.mark.parametrize('text, line', [
    ('a: 1\n---\nb: 2', 2), ('---\na: 1\n\n---\na: 2\n', 4), ('a: 1\n---\n', 2)])
def test_parameters_are_one_document(text, line):
    with pytest.raises(InputError) as raised:
        parse_parameters(text)
    assert str(raised.value) == (f'it has a second document, which begins in line {line}: write '
                                 'all parameters into the first one')


@pytest.mark.parametrize('text', ['---\na: 1', 'a: 1\n...\n', '--- # first\na: 1\n...'])
def test_marks_of_one_document_begin_no_second_one(text):
    assert parse_parameters(text) == {'a': 1}
