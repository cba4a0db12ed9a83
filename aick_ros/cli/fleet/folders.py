# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings in a tree of folders, on this machine or another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from aick_ros.sources import kind_of

ONE_FILE = ('.mcap', '.db3', '.bag')
"""Endings of files that are a recording each."""


@dataclass(frozen=True)
class Entry:
    """File or folder in a folder."""

    name: str
    is_folder: bool


def recordings_below(folder: str, entries_of: Callable[[str], Sequence[Entry]]) -> Iterator[str]:
    """
    Yield the recordings in a folder, however deep; one does not contain others.

    :param entries_of: returns what is in a folder, by name.
    """
    entries = entries_of(folder)
    names = {entry.name for entry in entries  # a bag may be a folder that ends as a file does
             if not (entry.is_folder and entry.name.endswith(ONE_FILE))}
    single = sorted(name for name in names if name.endswith(ONE_FILE))
    if single and 'metadata.yaml' not in names:
        yield from (f'{folder}/{name}' for name in single)
    elif kind_of(names, is_file=False) is not None:
        yield folder
        return
    for entry in entries:
        if entry.is_folder:
            yield from recordings_below(f'{folder}/{entry.name}', entries_of)
