# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Parameters: description, range and unit of each, and how a group of them is read and changed.

A group is a frozen dataclass whose fields are declared by :func:`parameter`; a nested group adds
its name and a dot.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from aick_ros.errors import InputError


@dataclass(frozen=True)
class Parameter:
    """
    Description of one parameter.

    :param name: dotted name, for example ``aick.alpha``.
    :param type: bool, int, float, str or tuple (of floats).
    :param choices: the values a string parameter may take; empty: any.
    """

    name: str
    type: type
    default: Any
    description: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def range_text(self) -> str:
        """The range as a person reads it, '' where there is none."""
        if self.choices:
            return ', '.join(repr(choice) for choice in self.choices)
        if self.minimum is None and self.maximum is None:
            return ''
        low = '-inf' if self.minimum is None else f'{self.minimum:g}'
        high = 'inf' if self.maximum is None else f'{self.maximum:g}'
        return f'{low} to {high}' + (f' {self.unit}' if self.unit else '')

    def convert(self, value: Any) -> Any:
        """
        Return ``value`` in this parameter's type.

        :param value: of the right type, or its text.
        :raises InputError: with the range where the value does not fit.
        """
        try:
            converted = _CONVERTERS[self.type](value)
        except (TypeError, ValueError):
            raise self._refuse(value, f'is not {_TYPE_NAMES[self.type]}') from None
        if self.choices and converted not in self.choices:
            raise self._refuse(value, f'is none of {self.range_text}')
        if self.type in (int, float):
            low = -math.inf if self.minimum is None else self.minimum
            high = math.inf if self.maximum is None else self.maximum
            if not (low <= converted <= high and math.isfinite(converted)):
                raise self._refuse(value, f'is outside {self.range_text or "the finite numbers"}')
        return converted

    def _refuse(self, value: Any, reason: str) -> InputError:
        return InputError(f'{self.name} = {value!r} {reason}; it is: {self.description}')


def parameter(default: Any, description: str, **kwargs: Any) -> Any:
    """Declare one parameter of a group; the keywords are those of :class:`Parameter`."""
    return field(default=default, metadata={'description': description, **kwargs})


def parameters(group: Any) -> Iterator[Parameter]:
    """
    Yield the parameters of a group of settings, with its present values as defaults.

    :param group: an instance of one of the settings classes, or the class for its defaults.
    """
    yield from _walk(group() if isinstance(group, type) else group, '')


def values(group: Any) -> dict[str, Any]:
    """Return the present values of a group of settings under their dotted names."""
    return {p.name: p.default for p in parameters(group)}


def with_values(group: Any, changes: Mapping[str, Any]) -> Any:
    """
    Return the settings with some values changed; all are checked before any is taken.

    :param group: an instance of one of the settings classes.
    :param changes: dotted name -> value or its text.
    :raises InputError: for an unknown name or a value outside its range.
    """
    known = {p.name: p for p in parameters(group)}
    checked = {}
    for name, value in changes.items():
        if name not in known:
            raise InputError(f'no parameter is called {name!r}: {hint(name, known)}')
        checked[name] = known[name].convert(value)
    return _replace(group, '', checked)


def hint(name: str, known: Iterable[str]) -> str:
    """Return what may have been meant by a name that is not known."""
    near = difflib.get_close_matches(name, known, n=3)
    return f'did you mean {" or ".join(near)}?' if near else 'see the parameter table'


_TYPE_NAMES = {bool: 'true or false', int: 'a whole number', float: 'a number', str: 'text',
               tuple: 'a list of numbers'}
_TYPES = {'bool': bool, 'int': int, 'float': float, 'str': str, 'tuple': tuple}


def _walk(group: Any, prefix: str) -> Iterator[Parameter]:
    for f in dataclasses.fields(group):
        value = getattr(group, f.name)
        if dataclasses.is_dataclass(value):
            yield from _walk(value, f'{prefix}{f.name}.')
        else:
            yield Parameter(f'{prefix}{f.name}', _TYPES[f.type], value, **f.metadata)


def _replace(group: Any, prefix: str, changes: Mapping[str, Any]) -> Any:
    new = {}
    for f in dataclasses.fields(group):
        value, name = getattr(group, f.name), f'{prefix}{f.name}'
        if dataclasses.is_dataclass(value):
            new[f.name] = _replace(value, f'{name}.', changes)
        else:
            new[f.name] = changes.get(name, value)
    return type(group)(**new)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _truth(value: Any) -> bool:
    if isinstance(value, str):
        return _TRUTHS.index(value.lower()) == 1
    if not isinstance(value, bool):
        raise TypeError
    return value


def _whole_number(value: Any) -> int:
    number = _number(value)
    if not number.is_integer():
        raise ValueError
    return int(number)


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _numbers(value: Any) -> tuple[float, ...]:
    items = value.replace(',', ' ').split() if isinstance(value, str) else value
    return tuple(_number(item) for item in items)


_TRUTHS = ('false', 'true')
_CONVERTERS = {bool: _truth, int: _whole_number, float: _number, str: _text, tuple: _numbers}
