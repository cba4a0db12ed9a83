# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arguments from a caller's code, checked where they enter."""

from __future__ import annotations

import math
from typing import SupportsFloat, TypeVar

import numpy as np

from aick_ros.errors import InputError

_Kind = TypeVar('_Kind')


def required(value: object, kind: type[_Kind], name: str) -> _Kind:
    """
    Return a value that is of a class.

    :param name: of the value, for people.
    :raises InputError: where it is not.
    """
    if not isinstance(value, kind):
        raise _rejected(name, value, f'an object of the class {kind.__name__}')
    return value


def required_method(value: object, method: str, name: str) -> None:
    """
    Check that an object has a method, by which alone it is used.

    :raises InputError: where it has not.
    """
    if not callable(getattr(value, method, None)):
        raise _rejected(name, value, f'an object with the method {method}')


def number(value: object, name: str) -> float:
    """
    Return a number, which may be infinite.

    :raises InputError: where it is none, or NaN.
    """
    if type(value) is float and not math.isnan(value):
        return value  # most are: a protocol takes a hundred times as long
    try:
        converted = float(value) if isinstance(value, SupportsFloat) else math.nan
    except (TypeError, ValueError, OverflowError):
        converted = math.nan
    if math.isnan(converted):
        raise _rejected(name, value, 'a number')
    return converted


def whole_number(value: object, name: str) -> int:
    """
    Return a whole number of 64 bits.

    :raises InputError: where it is none.
    """
    if not isinstance(value, int | np.integer) or not -2 ** 63 <= int(value) < 2 ** 63:
        raise _rejected(name, value, 'a 64-bit whole number')
    return int(value)


def numbers(values: object, shape: tuple[int | None, ...], name: str,
            kind: type[np.floating] = np.float64) -> np.ndarray:
    """
    Return numbers as an array of a type; the array given, where it is one.

    :param shape: the length of each axis, None for any.
    :raises InputError: where they are no real numbers, or of another shape.
    """
    if type(values) is np.ndarray and _has_shape(values, shape):
        if values.dtype == kind:
            return values
        if values.dtype == np.float32:  # exact in every other kind
            return values.astype(kind)
    try:
        # without a type first, as complex numbers would lose a part
        given = np.asarray(values)
        with np.errstate(over='ignore'):
            array = given.astype(kind, casting='same_kind')
    except (TypeError, ValueError, OverflowError):
        raise _rejected(name, values, f'an array of numbers of the shape {_text(shape)}') from None
    if not _has_shape(array, shape):
        raise _rejected(name, given, f'the shape {_text(shape)}')
    return array


def required_array(array: object, kind: type[np.generic], shape: tuple[int | None, ...],
                   name: str) -> None:
    """
    Check that an array has a type and a shape; None in the shape for any length.

    :raises InputError: where it has not, or is no array.
    """
    if (not isinstance(array, np.ndarray) or array.dtype != kind
            or not _has_shape(array, shape)):
        raise _rejected(name, array, f'an array of {kind.__name__} of the shape {_text(shape)}')


def _has_shape(array: np.ndarray, shape: tuple[int | None, ...]) -> bool:
    """Return whether an array has a shape, of which None stands for any length."""
    if array.ndim != len(shape):
        return False
    for length, actual in zip(shape, array.shape):  # a loop: in a third of the time of all()
        if length is not None and length != actual:
            return False
    return True


def _rejected(name: str, value: object, wanted: str) -> InputError:
    """Return the error that says in a few words what a value is, and what it should be."""
    if isinstance(value, np.ndarray):
        what = f'an array of {value.dtype} of the shape {_text(value.shape)}'
    elif value is None or isinstance(value, bool | float | str | np.number):
        what = repr(value)
    elif isinstance(value, int):
        what = repr(value) if abs(value) < 10 ** 30 else 'a very large number'
    else:
        what = f'an object of the class {type(value).__name__}'
    return InputError(f'{name}: {what if len(what) <= 80 else what[:80] + "..."}, where {wanted} '
                      'is required')


def _text(shape: tuple[int | None, ...]) -> str:
    return 'x'.join('N' if length is None else str(length) for length in shape) or '()'
