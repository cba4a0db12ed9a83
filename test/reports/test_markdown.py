# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

import re

import pytest

from aick_ros.errors import InputError
from aick_ros.reports.markdown import fill, number, ratio, table

CONTENTS = {'speed of light': lambda: '299,792,458', 'sum': lambda a, b: str(int(a) + int(b)),
            'of': {'x': 'y'}.__getitem__}


def test_braces_are_filled_in():
    assert (fill('c = {{speed of light}} m/s, {{sum 2 3}} and {{of x}}; {not this}', CONTENTS)
            == 'c = 299,792,458 m/s, 5 and y; {not this}')


@pytest.mark.parametrize('text', ['{{speed}}', '{{sum 2}}', '{{of z}}', '{{speed of sound}}'])
def test_braces_that_stand_for_nothing_are_refused(text):
    with pytest.raises(InputError, match=re.escape(text)):
        fill(f'before {text} after', CONTENTS)


def test_a_table_has_its_head_first():
    assert table([('a', 'b'), ('1', '2')]) == '| a | b |\n|---|---|\n| 1 | 2 |'


@pytest.mark.parametrize(('value', 'text'), [
    (None, '-'), (0.012345, '0.0123'), (99.94, '99.9'), (1234.5, '1,234')])
def test_numbers_have_three_digits(value, text):
    assert number(value) == text


def test_ratios_have_two_decimals():
    assert (ratio(None), ratio(0.125), ratio(1)) == ('-', '0.12', '1.00')
