# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The recordings that the sources of a command line stand for."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from itertools import chain
from pathlib import Path

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_LIST_BYTES, MAX_RECORDINGS
from aick_ros.borders.names import quoted_if_blank
from aick_ros.cli.fleet.folders import Entry, recordings_below
from aick_ros.cli.fleet.patterns import matches_of
from aick_ros.cli.fleet.remote import recordings_at
from aick_ros.cli.fleet.urls import is_url
from aick_ros.errors import InputError
from aick_ros.sources import is_rendered

_COMMENT = re.compile(r'(^|\s)#.*')  # a URL may have a # in it


def find_recordings(sources: Sequence[str], listed: Path | None) -> list[str]:
    """
    Return the recordings that paths, patterns and folders stand for, each once, in order.

    Paths are absolute, as workers may work in other folders.

    :param listed: file with more sources, one per line; empty lines and comments (#) are ignored.
    :raises InputError: where a source is none, there is no source, or too many.
    """
    every = _distinct([sources, _lines(listed) if listed is not None else ()])
    if not every:
        raise InputError('no recording is given: name recordings or folders of recordings, or '
                         'list them in a file (--list)')
    return list(_distinct(_absolute(source) for source in every))


def _distinct(names: Iterable[Iterable[str]]) -> dict[str, None]:
    """Return names, each once."""
    found = dict[str, None]()
    for name in chain.from_iterable(names):
        found[name] = None
        if len(found) > MAX_RECORDINGS:
            raise InputError(f'more than {MAX_RECORDINGS} recordings are given: name fewer, in '
                             'several fleets')
    return found


def _absolute(source: str) -> Iterator[str]:
    """Yield the recordings that a source stands for, as workers in other folders find them."""
    for recording in _found(source):
        yield os.path.abspath(recording) if is_path(recording) else recording


def is_path(source: str) -> bool:
    """Return whether a source is a file or folder of this machine."""
    return not is_rendered(source) and not is_url(source)


def _lines(path: Path) -> Iterator[str]:
    for line in StringIO(read_text(path, 'the list of recordings', MAX_LIST_BYTES)):
        source = _COMMENT.sub('', line).strip()
        if source:
            yield source


def _found(source: str) -> Iterator[str]:
    if is_url(source):
        yield from recordings_at(source)
        return
    if not is_path(source) or os.path.lexists(source):
        yield from _below(source)
        return
    matches = sorted(map(os.path.abspath, matches_of(source)))  # no name of what is rendered
    if not matches:
        raise InputError(f'{quoted_if_blank(source)} does not exist, nor does a file that it is a '
                         'pattern of: name a recording, or a folder with recordings in it')
    for match in matches:
        yield from _below(match)


def _below(source: str) -> Iterator[str]:
    """Yield a recording itself, or those in a folder."""
    if not is_path(source) or not os.path.isdir(source):
        yield source
        return
    found = list(recordings_below(source, _entries_of))
    if not found:
        raise InputError(f'{source} has no recording, nor has a folder in it')
    yield from found


def _entries_of(folder: str) -> list[Entry]:
    try:
        return [Entry(entry.name, entry.is_dir(follow_symlinks=False))
                for entry in sorted(os.scandir(folder), key=lambda entry: entry.name)]
    except OSError as error:
        raise InputError(f'cannot read {folder}: {error.strerror}') from None
