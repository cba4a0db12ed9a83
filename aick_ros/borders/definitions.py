# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Definitions of messages in bags, of limited size.

rosbags makes Python code of them: for each line, each field, and each element of an array of
strings or messages, so that a line may cost any memory and time.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, lru_cache
from importlib import import_module
from typing import Any

from aick_ros.borders.limits import MAX_DEFINED_FIELDS, MAX_DEFINITION_LINES, MAX_MESSAGE_FIELDS
from aick_ros.errors import InputError

Types = Mapping[str, tuple[Any, Any]]
"""Name of a type -> its constants, and its fields with name and description, as rosbags has it."""

_PARSED = 256  # definitions that are kept for the next reading of a bag; chosen


class _Read:
    """Texts and types of the definitions of one bag, as far as they have been read."""

    def __init__(self) -> None:
        self._texts, self._types = set[tuple[str, ...]](), set[str]()
        self._lines = self._fields = 0

    def add_text(self, text: tuple[str, ...]) -> None:
        """Count a definition, and perhaps a name; InputError where there are too many lines."""
        if text in self._texts:
            return
        self._texts.add(text)
        self._lines += text[0].count('\n') + 1
        if self._lines > MAX_DEFINITION_LINES:
            raise InputError(f'its definitions of messages have more than {MAX_DEFINITION_LINES} '
                             'lines')

    def add_types(self, types: Types) -> None:
        """Count the fields of types; InputError where there are too many."""
        for name in types.keys() - self._types:
            self._types.add(name)
            self._fields += len(types[name][1])
        if self._fields > MAX_DEFINED_FIELDS:
            raise InputError(f'it defines messages with more than {MAX_DEFINED_FIELDS} fields')


_read: ContextVar[_Read | None] = ContextVar('_read', default=None)


@contextmanager
def definitions_counted() -> Iterator[None]:
    """Let rosbags open one bag in the block, with :func:`limit_definitions`."""
    token = _read.set(_Read())
    try:
        yield
    finally:
        _read.reset(token)


@cache
def limit_definitions() -> None:
    """Let rosbags, which parses any number of definitions, use the limits of this module."""
    reader = import_module('rosbags.highlevel.anyreader')
    for name in ('get_types_from_msg', 'get_types_from_idl'):
        setattr(reader, name, _limited(getattr(reader, name)))


def _limited(parse: Callable[..., Types]) -> Callable[..., Types]:
    parse = lru_cache(_PARSED)(parse)

    def parse_limited(*text: str) -> Types:
        read = _read.get() or _Read()
        read.add_text(text)
        types = parse(*text)
        read.add_types(types)
        return types
    return parse_limited


def check_fields(types: Types, names: Collection[str]) -> None:
    """
    Check the fields of messages that are to be read, those of the messages in them included.

    :param types: those that a bag defines.
    :param names: those that are to be read; one that is not defined is left to the reader.
    :raises InputError: where they are too many, each element of an array of strings or messages
        counted; the message starts with 'its'.
    """
    kinds = import_module('rosbags.interfaces').Nodetype
    left, known, count = list(names), set[str](), 0
    while left:
        name = left.pop()
        if name in known or name not in types:
            continue
        known.add(name)
        for _, description in types[name][1]:
            kind, length = description, 1
            if description[0] in (kinds.ARRAY, kinds.SEQUENCE):
                kind = description[1][0]
            is_number = kind[0] == kinds.BASE and kind[1][0] not in ('string', 'wstring')
            if description[0] == kinds.ARRAY and not is_number:
                length = description[1][1]
            if kind[0] == kinds.NAME:
                left.append(kind[1])
            count += length
        if count > MAX_MESSAGE_FIELDS:
            raise InputError(f'its definition of {" or ".join(sorted(names))} has more than '
                             f'{MAX_MESSAGE_FIELDS} fields, elements of arrays included')
