# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Patterns of files of this machine, in folders with links that lead in circles."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator

_ANY_FOLDERS = '**'


def matches_of(pattern: str) -> set[str]:
    """
    Return the paths that match a pattern.

    As ``glob.glob`` does, but ``**`` does not follow links: two that lead back would make as many
    paths as 2 to the power of 40. Links whose names a part of the pattern matches are followed.
    """
    before, *rest = _parts(pattern)
    found = set(glob.glob(before)) if before or not rest else {os.curdir}
    for part in rest:
        folders = {each for start in found for each in _folders(start)}
        found = {match for folder in folders
                 for match in glob.glob(os.path.join(glob.escape(folder), part))}
        if part == '*' and pattern.endswith(_ANY_FOLDERS):
            found.update(folders)
    return found


def _parts(pattern: str) -> Iterator[str]:
    """Yield what is before, between and after the ``**`` of a pattern; ``*`` at its end."""
    part, was_any = list[str](), False
    for name in pattern.split('/'):
        if name != _ANY_FOLDERS:
            part.append(name)
        elif not was_any:
            yield '/'.join(part) or '/' * bool(part)
            part = []
        was_any = name == _ANY_FOLDERS
    yield '/'.join(part or ['*'])


def _folders(start: str) -> Iterable[str]:
    """Yield a folder and those below it, but for hidden ones."""
    for folder, below, _ in os.walk(start):
        yield folder
        below[:] = [name for name in below if not name.startswith('.')]
