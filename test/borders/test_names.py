# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names are printed as characters that do nothing."""

import os
from pathlib import Path

import pytest

from aick_ros.borders.names import counted, one_line, printable, quoted, quoted_if_blank


@pytest.mark.parametrize('name, shown', [
    ('\x1b[31mred', r'\x1b[31mred'), ('a\tb\r', r'a\tb\r'), ('\x00', r'\x00'),
    ('\x9b2J', r'\x9b2J'), ('\u202eabc', r'\u202eabc'), ('\u2028', r'\u2028'),
    (os.fsdecode(b'a\xff'), r'a\xff'), ('\ud800', r'\ud800')])
def test_invisible_characters_are_shown(name, shown):
    assert printable(name) == shown
    assert printable(name).isprintable()


@pytest.mark.parametrize('text', ['/camera/rgb', 'größe 1 × 2', '日本', 'two\nlines', ''])
def test_other_text_is_unchanged(text):
    assert printable(text) == text


def test_messages_are_one_line_of_limited_length():
    assert one_line(' two\n\n lines\x1b ') == r'two lines\x1b'
    long = one_line('start ' + '\x1b' * 100_000 + ' end')
    assert long.startswith(r'start \x1b') and long.endswith(' end') and len(long) < 2100
    assert '[... 398010 characters ...]' in long
    assert one_line('x' * 2000) == 'x' * 2000


@pytest.mark.parametrize('name, shown', [
    ('', "''"), ('camera', "'camera'"), ('\x1b[31m\n', r"'\x1b[31m\n'"),
    ('x' * 298, repr('x' * 298))])
def test_names_from_messages_are_quoted(name, shown):
    assert quoted(name) == shown


def test_the_middle_of_a_very_long_name_is_left_out():
    assert quoted('a' + 'x' * 10 ** 6 + 'b') == (
        f"'a{'x' * 148} [... 999704 characters ...] {'x' * 148}b'")


@pytest.mark.parametrize('name, shown', [
    ('', "''"), (' ', "' '"), ('\n\t', r"'\n\t'"), (Path('  '), "'  '"), (' a ', ' a '),
    (Path('a b'), 'a b')])
def test_blank_names_are_quoted(name, shown):
    assert quoted_if_blank(name) == shown


def test_beyond_2000_characters_the_middle_is_left_out():
    text = ''.join(chr(ord('a') + i % 26) for i in range(2001))
    assert one_line(text) == f'{text[:1000]} [... 1 characters ...] {text[-1000:]}'


def test_counts_have_their_nouns():
    assert [counted(count, 'frame') for count in (0, 1, 2)] == [
        '0 frames', '1 frame', '2 frames']
