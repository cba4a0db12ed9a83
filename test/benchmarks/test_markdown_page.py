# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The templates and tables of the generated pages."""

import re
from pathlib import Path

import pytest

from aick_ros.errors import InputError

CONTENTS = {'speed of light': lambda: '299,792,458', 'sum': lambda a, b: str(int(a) + int(b)),
            'of': {'x': 'y'}.__getitem__}


@pytest.fixture(scope='module')
def page(load):
    """Return the module."""
    return load(Path(__file__).parents[2] / 'benchmarks' / 'markdown_page.py')


def test_braces_are_filled_in(page):
    assert (page.fill('c = {{speed of light}} m/s, {{sum 2 3}} and {{of x}}; {not this}', CONTENTS)
            == 'c = 299,792,458 m/s, 5 and y; {not this}')


@pytest.mark.parametrize('text', ['{{speed}}', '{{sum 2}}', '{{of z}}', '{{speed of sound}}'])
def test_unknown_placeholders_are_rejected(page, text):
    with pytest.raises(InputError, match=re.escape(text)):
        page.fill(f'before {text} after', CONTENTS)


def test_a_table_has_its_head_first(page):
    assert page.table([('a', 'b'), ('1', '2')]) == '| a | b |\n|---|---|\n| 1 | 2 |'


@pytest.mark.parametrize(('value', 'text'), [
    (None, '-'), (0.012345, '0.0123'), (99.94, '99.9'), (1234.5, '1,234')])
def test_numbers_have_three_digits(page, value, text):
    assert page.number(value) == text


def test_ratios_have_two_decimals(page):
    assert (page.ratio(None), page.ratio(0.125), page.ratio(1)) == ('-', '0.12', '1.00')
