# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Declaration of parameters, and reading and changing a group of them by name.

A group is a frozen dataclass whose fields are declared by :func:`parameter`. Parameters of a
nested group are named ``group.parameter``.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import Field, dataclass, field
from typing import Any, ClassVar, Protocol, SupportsFloat, TypeVar

from aick_ros.errors import InputError

Value = bool | int | float | str | tuple[float, ...]
"""Type of the value of a parameter."""


class Group(Protocol):
    """A frozen dataclass whose fields are declared by :func:`parameter`, or are groups."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


_Value = TypeVar('_Value')
_Group = TypeVar('_Group', bound=Group)


@dataclass(frozen=True)
class Parameter:
    """
    Declaration of one parameter.

    :param name: dotted name, for example ``aick.alpha``.
    :param type: bool, int, float, str or tuple (of floats).
    :param choices: allowed values of a string parameter; empty: any.
    """

    name: str
    type: type
    default: Value
    description: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def range_text(self) -> str:
        """Allowed range or choices for display; '' if any value is allowed."""
        if self.choices:
            return ', '.join(repr(choice) for choice in self.choices)
        if self.minimum is None and self.maximum is None:
            return ''
        low = '-inf' if self.minimum is None else f'{self.minimum:g}'
        high = 'inf' if self.maximum is None else f'{self.maximum:g}'
        return f'{low} to {high}' + (f' {self.unit}' if self.unit else '')

    def convert(self, value: object) -> Value:
        """
        Return a value converted to the type of this parameter.

        :param value: a value of that type, or its text.
        :raises InputError: if the type is wrong or the value is out of range.
        """
        try:
            converted = _CONVERTERS[self.type](value)
        except (TypeError, ValueError, OverflowError):
            raise self._error(value, f'is not {_TYPE_NAMES[self.type]}') from None
        if self.choices and converted not in self.choices:
            raise self._error(value, f'is none of {self.range_text}')
        if isinstance(converted, int | float) and not self._is_in_range(converted):
            raise self._error(value, f'is outside {self.range_text or "the finite numbers"}')
        return converted

    def _is_in_range(self, number: float) -> bool:
        low = -math.inf if self.minimum is None else self.minimum
        high = math.inf if self.maximum is None else self.maximum
        return low <= number <= high and math.isfinite(number)

    def _error(self, value: object, reason: str) -> InputError:
        return InputError(f'{self.name} = {value!r} {reason}. Meaning: {self.description}')


@dataclass(frozen=True)
class Checked:
    """Base of the groups of settings: values are converted and checked as a group is made."""

    def __post_init__(self) -> None:
        """Reject values of another type or out of range."""
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if str(f.type) in _TYPES:
                declared = Parameter(f.name, _TYPES[str(f.type)], value, **f.metadata)
                object.__setattr__(self, f.name, declared.convert(value))
            elif not isinstance(value, type(f.default)):
                raise InputError(f'{f.name} = {value!r} is not of {type(f.default).__name__}')


def parameter(default: _Value, description: str, *, unit: str = '', minimum: float | None = None,
              maximum: float | None = None, choices: tuple[str, ...] = ()) -> _Value:
    """Declare one parameter of a group; the arguments are those of :class:`Parameter`."""
    return field(default=default, metadata={
        'description': description, 'unit': unit, 'minimum': minimum, 'maximum': maximum,
        'choices': choices})


def parameters(group: Group | type[Group]) -> Iterator[Parameter]:
    """
    Yield the parameters of a group of settings, with its current values as defaults.

    :param group: an instance of a settings class, or the class for its defaults.
    """
    yield from _walk(group() if isinstance(group, type) else group, '')


def values(group: Group | type[Group]) -> dict[str, Value]:
    """Return the current values of a group of settings by dotted name."""
    return {p.name: p.default for p in parameters(group)}


def with_values(group: _Group, changes: Mapping[str, object]) -> _Group:
    """
    Return a copy of the settings with some values changed, after checking all of them.

    :param group: an instance of a settings class.
    :param changes: dotted name -> value or its text.
    :raises InputError: for an unknown name or a value out of range.
    """
    if not isinstance(changes, Mapping):
        raise InputError(f'the changes are of the type {type(changes).__name__}: a dictionary of '
                         'names and values is required')
    known = {p.name: p for p in parameters(group)}
    checked = {}
    for name, value in changes.items():
        if not isinstance(name, str) or name not in known:
            raise InputError(f'no parameter is called {name!r}: {hint(name, known)}')
        checked[name] = known[name].convert(value)
    return _replace(group, '', checked)


def hint(name: str, known: Iterable[str]) -> str:
    """Return a suggestion for an unknown name."""
    similar = difflib.get_close_matches(str(name), known, n=3)
    return (f'did you mean {" or ".join(similar)}?' if similar
            else 'all are listed by aick parameters')


def _walk(group: Group, prefix: str) -> Iterator[Parameter]:
    for f in dataclasses.fields(group):
        value = getattr(group, f.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from _walk(value, f'{prefix}{f.name}.')
        else:
            yield Parameter(f'{prefix}{f.name}', _TYPES[str(f.type)], value, **f.metadata)


def _replace(group: _Group, prefix: str, changes: Mapping[str, Value]) -> _Group:
    new: dict[str, object] = {}
    for f in dataclasses.fields(group):
        value, name = getattr(group, f.name), f'{prefix}{f.name}'
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            new[f.name] = _replace(value, f'{name}.', changes)
        else:
            new[f.name] = changes.get(name, value)
    return dataclasses.replace(group, **new)


def _to_bool(value: object) -> bool:
    if isinstance(value, bool):
        return value
    return ('false', 'true').index(_to_str(value).lower()) == 1


def _to_int(value: object) -> int:
    number = _to_float(value)
    if not number.is_integer():
        raise ValueError
    return int(number)


def _to_float(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, str | SupportsFloat):
        raise TypeError
    return float(value)


def _to_str(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _to_tuple(value: object) -> tuple[float, ...]:
    if isinstance(value, str):  # as launch passes a list on
        value = value.strip().removeprefix('[').removesuffix(']').replace(',', ' ').split()
    if not isinstance(value, Iterable):
        raise TypeError
    return tuple(_to_float(item) for item in value)


_CONVERTERS: dict[type, Callable[[object], Value]] = {
    bool: _to_bool, int: _to_int, float: _to_float, str: _to_str, tuple: _to_tuple}
_TYPE_NAMES = {bool: 'true or false', int: 'a whole number', float: 'a number', str: 'text',
               tuple: 'a list of numbers'}
_TYPES = {'bool': bool, 'int': int, 'float': float, 'str': str, 'tuple[float, ...]': tuple}
