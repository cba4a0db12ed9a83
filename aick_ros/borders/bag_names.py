# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of SQLite bags, which rosbags puts into URIs as they are."""

from __future__ import annotations

import os
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any
from urllib.parse import quote

_SCHEME, _QUERY = 'file:', '?immutable=1'


def escaped(uri: str) -> str:
    """Return a URI of rosbags with the ``#``, ``?`` and ``%`` of its path escaped."""
    path = uri.removeprefix(_SCHEME).removesuffix(_QUERY)
    return _SCHEME + quote(os.fsencode(path)) + uri[len(_SCHEME) + len(path):]


class _Escaping:
    """A library for SQLite that opens escaped URIs."""

    def __init__(self, library: ModuleType) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        return getattr(self._library, name)

    def connect(self, address: str, /, **options: Any) -> Any:
        return self._library.connect(escaped(address), **options)

    def Connection(self, address: str, /, **options: Any) -> Any:  # noqa: N802, the name of apsw
        return self._library.Connection(escaped(address), **options)


@cache
def escape_names() -> None:
    """Let rosbags open and write the bags whose paths have characters with a meaning in URIs."""
    storage = import_module('rosbags.rosbag2.storage_sqlite3')
    for name in ('sqlite3', 'apsw'):
        if hasattr(storage, name):
            setattr(storage, name, _Escaping(getattr(storage, name)))
