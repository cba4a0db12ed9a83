# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frozen dataclasses of values that were checked where they entered."""

from __future__ import annotations

from dataclasses import Field
from typing import Any, ClassVar, Protocol, TypeVar


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


_Record = TypeVar('_Record', bound=_Dataclass)


def replaced(record: _Record, /, **changes: Any) -> _Record:
    """
    Return a record with other values of some fields.

    It takes a third of the time of ``dataclasses.replace``: neither names nor values are checked.
    """
    values, changed = vars(record), object.__new__(type(record))
    kept = vars(changed)
    for name in record.__dataclass_fields__:  # not what a cached property has left
        kept[name] = values[name]
    kept.update(changes)
    return changed
