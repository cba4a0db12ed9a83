# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings at a URL, and the files that one consists of."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from urllib.parse import quote, unquote

from aick_ros.borders.limits import MAX_REMOTE_DEPTH, MAX_REMOTE_FILES
from aick_ros.cli.fleet.attempts import asked_again
from aick_ros.cli.fleet.folders import ONE_FILE, Entry, recordings_below
from aick_ros.cli.fleet.urls import FileSystem, errors_of, is_web, name_of, open_url
from aick_ros.errors import InputError

_PATTERN = re.compile(r'[*[]')
_CONNECTIONS = 16  # at a time, to ask for sizes; chosen
_VERSION = ('ETag', 'mtime', 'LastModified', 'Last-Modified', 'updated', 'last_modified')
"""Keys by which file systems give the version of a file, or the time of its last change."""


@dataclass(frozen=True)
class RemoteFile:
    """
    A file of a recording.

    :param path: in its file system.
    :param name: relative to the folder that the recording is in.
    :param size: in bytes; None where the server does not say.
    :param version: changes with its content; empty where the server does not say.
    """

    path: str
    name: str
    size: int | None
    version: str


def is_one_file(url: str) -> bool:
    """Return whether a URL has the name of a recording that is a file; folders may, too."""
    return name_of(url).endswith(ONE_FILE)


def recordings_at(url: str) -> Iterator[str]:
    """
    Yield the URLs of recordings: a file, those in a folder, or those that a pattern stands for.

    :raises InputError: where there is none.
    """
    if _PATTERN.search(_after_server(url)):
        with errors_of(url):
            system, path = open_url(url)
            found = sorted(system.unstrip_protocol(match)
                           for match in system.glob(path, maxdepth=MAX_REMOTE_DEPTH))
    else:
        with errors_of(url):
            open_url(url)
        found = [url.rstrip('/')]
    entries_of = partial(_entries_of, deepest=url.count('/') + MAX_REMOTE_DEPTH)
    below = [recording for each in found for recording in (
        [each] if is_one_file(each) else recordings_below(each, entries_of))]
    if not below:
        raise InputError(f'{url} has no recording: at a URL it is a {", ".join(ONE_FILE)} file, '
                         'or a folder whose server lists its files')
    yield from below


@asked_again
def files_of(url: str) -> list[RemoteFile]:
    """
    Return the files of the recording at a URL.

    :raises InputError: where it has none, or too many.
    :raises TransferError: where its server cannot be asked.
    """
    with errors_of(url):
        system, path = open_url(url)
        found = _single_file(system, url, path) or dict(islice(
            _walk(system, url, path, f'{name_of(url)}/', MAX_REMOTE_DEPTH), MAX_REMOTE_FILES + 1))
        if not found:
            raise InputError(f'{url} has no files')
        if len(found) > MAX_REMOTE_FILES:
            raise InputError(f'{url} has more than {MAX_REMOTE_FILES} files: name a recording')
        with ThreadPoolExecutor(_CONNECTIONS) as pool:
            known = pool.map(lambda entry: entry if entry.get('size') is not None
                             else system.info(str(entry['name'])), found.values())
            return [_file(name, str(entry['name']), info)
                    for (name, entry), info in zip(found.items(), known)]


def _after_server(url: str) -> str:
    """Return a URL without its server, which has brackets where it is a number of IPv6."""
    return url.partition('://')[2].partition('/')[2] if is_web(url) else url


def _single_file(system: FileSystem, url: str, path: str) -> dict[str, Mapping[str, object]]:
    """Return name and facts of a recording that is a file; nothing of one that is a folder."""
    if not is_one_file(url):
        return {}
    info = system.info(path)
    return {} if _is_folder(info) else {name_of(url): _regular_file(system, url, info)}


@asked_again
def _entries_of(url: str, deepest: int) -> list[Entry]:
    _check_depth(url, deepest - url.count('/'))
    with errors_of(url):
        system, path = open_url(url)
        found = {_name_in(url, path, entry): entry for entry in system.ls(path, detail=True)}
    return [Entry(quote(name) if is_web(url) else name, _is_folder(entry))
            for name, entry in sorted(found.items()) if name]


def _walk(system: FileSystem, url: str, folder: str, prefix: str, depth: int
          ) -> Iterator[tuple[str, Mapping[str, object]]]:
    """Yield name and facts of the files in a folder and below it."""
    _check_depth(url, depth)
    for entry in system.ls(folder, detail=True):
        name = _name_in(url, folder, entry)
        if name and _is_folder(entry):
            yield from _walk(system, url, f'{entry["name"]}'.rstrip('/'), f'{prefix}{name}/',
                             depth - 1)
        elif name:
            yield f'{prefix}{name}', _regular_file(system, url, entry)


def _check_depth(url: str, left: int) -> None:
    if left < 0:
        raise InputError(f'{url} has folders in each other deeper than {MAX_REMOTE_DEPTH}: name a '
                         'recording')


def _regular_file(system: FileSystem, url: str, entry: Mapping[str, object]
                  ) -> Mapping[str, object]:
    """Return the facts of a file, those of its target for a link; InputError of anything else."""
    info = entry
    if info['type'] != 'file':  # lists have links as they are
        with suppress(FileNotFoundError):
            info = system.info(str(entry['name']))
    if info['type'] != 'file':
        raise InputError(f'{url} cannot be copied: {entry["name"]} is not a regular file')
    return info


def _is_folder(entry: Mapping[str, object]) -> bool:
    return entry['type'] == 'directory'


def _name_in(url: str, folder: str, entry: Mapping[str, object]) -> str:
    """Return the name of an entry of a folder; '' where it is none, as some links of a page."""
    path = str(entry['name'])
    name = path.removeprefix(f'{folder}/').rstrip('/')
    if is_web(url):
        name = '' if '?' in name or '#' in name else unquote(name)
    is_inside = path.startswith(f'{folder}/') and not {'/', '\0'} & set(name)
    return name if is_inside and name not in ('.', '..') else ''


def _file(name: str, path: str, info: Mapping[str, object]) -> RemoteFile:
    size = info.get('size')
    version = ' '.join(str(info[key]) for key in _VERSION if info.get(key) is not None)
    return RemoteFile(path, name, size if isinstance(size, int) else None, version)
