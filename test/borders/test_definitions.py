# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Definitions of messages cost no more than those of robots do."""

import pytest
from rosbags.highlevel import anyreader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aick_ros.borders import definitions
from aick_ros.borders.definitions import check_fields, definitions_counted, limit_definitions
from aick_ros.borders.limits import MAX_DEFINED_FIELDS, MAX_DEFINITION_LINES, MAX_MESSAGE_FIELDS
from aick_ros.errors import InputError

NEXT = '\n' + '=' * 80 + '\nMSG: a/'
LIMIT = MAX_MESSAGE_FIELDS


@pytest.fixture
def parse():
    """Return what rosbags parses definitions with."""
    limit_definitions()
    with definitions_counted():
        yield anyreader.get_types_from_msg


def fields(count):
    return ''.join(f'uint8 f{index}\n' for index in range(count))


@pytest.mark.parametrize('text', [
    'std_msgs/Header header\nfloat64[36] covariance\n',
    'string<=9[] names\nB[4] b' + NEXT + 'B\nbool c\n'])
def test_definitions_are_those_of_rosbags(parse, text):
    assert parse(text, 'a/msg/A') == get_types_from_msg(text, 'a/msg/A')


def test_lines_are_counted_before_they_are_parsed(parse, monkeypatch):
    parse('uint8 a\n', 'a/msg/A')
    text = '#\n' * (MAX_DEFINITION_LINES - 1)
    with pytest.raises(InputError, match='^its definitions of messages have more than '
                                         f'{MAX_DEFINITION_LINES} lines$'):
        parse(text, 'a/msg/B')


def test_each_bag_may_have_as_many(monkeypatch):
    monkeypatch.setattr(definitions, 'MAX_DEFINITION_LINES', 100)
    limit_definitions()
    for _ in range(3):
        with definitions_counted():
            for _ in range(9):  # topics of one type count once
                anyreader.get_types_from_msg(fields(70), 'a/msg/A')
            with pytest.raises(InputError, match='more than 100 lines'):
                anyreader.get_types_from_msg(fields(60), 'a/msg/B')


def test_fields_of_all_types_are_counted_each_type_once(parse, monkeypatch):
    monkeypatch.setattr(definitions, 'MAX_DEFINED_FIELDS', 100)
    for number in range(9):
        parse(f'B b{number}\n' + NEXT + 'B\n' + fields(90), f'a/msg/A{number}')
    with pytest.raises(InputError, match='^it defines messages with more than 100 fields$'):
        parse('uint8 a\nuint8 b\n', 'a/msg/C')
    assert MAX_DEFINED_FIELDS > 4 * sum(
        len(types) for _, types in get_typestore(Stores.ROS2_JAZZY).fielddefs.values())


@pytest.mark.parametrize('text, is_accepted', [
    (fields(LIMIT), True), (fields(LIMIT + 1), False),
    (f'string[{LIMIT}] a\n', True), (f'string[{LIMIT + 1}] a\n', False),
    ('string[1000000000] a\n', False), ('float64[1000000000] a\nstring[] b\n', True),
    (f'B[{LIMIT}] a' + NEXT + 'B\nuint8 a\n', False), ('B[9] a' + NEXT + 'B\nuint8 a\n', True),
    ('B[] b' + NEXT + 'B\nC c' + NEXT + 'C\n' + fields(LIMIT), False),
    ('A[] a\nB b' + NEXT + 'B\nA a\n', True)])
def test_fields_of_messages_that_are_read_are_limited(text, is_accepted):
    types = get_types_from_msg(text, 'a/msg/A')
    check_fields(types, ['a/msg/Other'])  # which is not defined
    if is_accepted:
        check_fields(types, ['a/msg/A'])
    else:
        with pytest.raises(InputError, match=f'^its definition of a/msg/A has more than {LIMIT} '
                                             'fields, elements of arrays included$'):
            check_fields(types, ['a/msg/A'])


def test_all_messages_of_ros_are_accepted():
    types = get_typestore(Stores.ROS2_JAZZY).fielddefs
    for name in types:
        check_fields(types, [name])
