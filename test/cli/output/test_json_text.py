# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""JSON as ``json`` reads it, on few lines, none of them long."""

import json

import pytest

from aick_ros.cli.output.json_text import json_text

CONTENT = {
    'name': 'a "quoted" name, with commas', 'nothing': None, 'empty': {}, 'none': [],
    'numbers': [i / 7 for i in range(40)], 'truth': [True, False],
    'nested': {str(gap): {'count': gap, 'success': {'0.0033': 0.1, '0.01': 1 / 3, '0.05': 1.0},
                          'pairs': [[i, i + gap, 0.1 * i] for i in range(20)]}
               for gap in (1, 5)},
    'words': ['word' * 8 for _ in range(6)]}


@pytest.mark.parametrize('content', [CONTENT, [CONTENT, 1], [], {}, 'text', 1.5, None, (1, 2)],
                         ids=lambda content: type(content).__name__)
def test_it_is_json_on_short_lines(content):
    text = json_text(content)
    assert json.loads(text) == json.loads(json.dumps(content))
    assert max(map(len, text.splitlines())) <= 99


def test_what_is_short_has_one_line():
    lines = json_text(CONTENT).splitlines()
    assert '  "truth": [true, false],' in lines
    assert sum('"success":' in line and '}' in line for line in lines) == 2
    assert len(lines) < json.dumps(CONTENT, indent=2).count('\n') / 3


@pytest.mark.parametrize('number', [float('nan'), float('inf')])
def test_numbers_that_json_does_not_have_are_rejected(number):
    with pytest.raises(ValueError, match='JSON'):
        json_text({'deep': [{'number': number}]})


@pytest.mark.parametrize('make', [lambda n: {'key': n * [1], 'b': 2}, lambda n: [n * [1], 2],
                                  lambda n: {'a': {'b': [n * 'x']}, 'c': 1}])
def test_no_line_is_longer_than_the_width_with_its_comma(make):
    contents = [make(n) for n in range(20, 60)] + [make(n) for n in range(75, 83)]
    texts = list(map(json_text, contents))
    assert [json.loads(text) for text in texts] == contents
    longest = max(len(line) for text in texts for line in text.splitlines())
    assert longest == 99  # with the comma after it


def test_rows_of_numbers_are_indented_alike():
    lines = json_text({'a': {'numbers': list(range(100))}}).splitlines()
    rows = [line for line in lines if line.strip()[0].isdigit()]
    assert len(rows) > 3 and {len(row) - len(row.lstrip()) for row in rows} == {6}
    assert [line for line in lines if line not in rows] == [
        '{', '  "a": {', '    "numbers": [', '    ]', '  }', '}']


def test_texts_are_not_broken_however_long():
    assert json_text(300 * 'word ') == json.dumps(300 * 'word ')


def test_sentences_have_a_line_each():
    reasons = [f'it is too dark to see number {i}, and far' for i in range(8)]
    lines = json_text({'reasons': reasons}).splitlines()
    assert [line.strip().rstrip(',') for line in lines[2:-2]] == [f'"{each}"' for each in reasons]
