# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names from outside and counts, as sentences for terminals and logs have them."""

from __future__ import annotations

from pathlib import Path

_LONGEST = 2000  # characters of a message; chosen: more than most paths, less than a screen
_LONGEST_QUOTED = 300  # characters of one name in it; chosen


def one_line(text: str) -> str:
    """Return a message in one printable line, without its middle where it is very long."""
    return _shortened(printable(' '.join(text.split())), _LONGEST)


def quoted(name: str) -> str:
    """Return a name from a message in quotes, without its middle where it is very long."""
    return _shortened(repr(name), _LONGEST_QUOTED)


def printable(text: str) -> str:
    r"""
    Return text with control and other invisible characters shown, for example as ``\x1b``.

    Spaces and line ends stay. A name of a file that is not UTF-8 has its bytes shown.
    """
    return ''.join(character if character.isprintable() or character == '\n'
                   else _escaped(character) for character in text)


def quoted_if_blank(name: str | Path) -> str:
    """Return a name for a sentence, in quotes where nothing of it could be seen."""
    return str(name) if str(name).strip() else repr(str(name))


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, of which the singular is given: 1 frame, 2 frames."""
    return f'{count} {noun}' if count == 1 else f'{count} {noun}s'


def _shortened(line: str, longest: int) -> str:
    if len(line) <= longest:
        return line
    half = longest // 2
    return f'{line[:half]} [... {len(line) - 2 * half} characters ...] {line[-half:]}'


def _escaped(character: str) -> str:
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:  # a byte that is not UTF-8 (PEP 383)
        return f'\\x{code - 0xDC00:02x}'
    return character.encode('unicode_escape').decode('ascii')
