# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""URLs of recordings, of any kind that fsspec reads, and the file systems that they lead to."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Protocol
from urllib.parse import unquote, urlsplit

from aick_ros.cli.fleet.pace import SILENCE_LIMIT, SilentServerError
from aick_ros.errors import InputError, TransferError, installation, package_of

_NOT_FOUND = 404  # by definition, of HTTP
_URL = re.compile(r'[a-z][a-z0-9+.-]+://')
_BUCKETS = ('s3', 's3a')
_BUCKET_ATTEMPTS = 2  # of each request; chosen
_CHAIN = '::'  # by which fsspec reads one URL through another


class FileSystem(Protocol):
    """The part of a file system of fsspec that is used."""

    def ls(self, path: str, detail: bool) -> Sequence[Mapping[str, object]]:
        """Return name, type and, where it is known, size and version of all in a folder."""

    def info(self, path: str) -> Mapping[str, object]:
        """Return the same of a file."""

    def glob(self, path: str, maxdepth: int) -> Sequence[str]:
        """Return the paths that match a pattern; ``**`` stands for so many folders at most."""

    def get(self, rpath: Sequence[str], lpath: Sequence[str], callback: object) -> object:
        """Copy files to this machine."""

    def invalidate_cache(self) -> None:
        """Forget lists of files."""

    def unstrip_protocol(self, name: str) -> str:
        """Return the URL of a path."""


def is_url(source: str) -> bool:
    """Return whether a source is a URL."""
    return _URL.match(source) is not None


def is_web(url: str) -> bool:
    """Return whether a URL is one of a web server: with escapes, and perhaps a query."""
    return url.startswith(('http://', 'https://'))


def name_of(url: str) -> str:
    """Return the name of the file or folder at a URL, as a file of this machine may have it."""
    path = unquote(urlsplit(url).path) if is_web(url) else url.partition('://')[2]
    name = path.rstrip('/').rpartition('/')[2]
    return 'recording' if name in ('', '.', '..') or '\0' in name else name


def open_url(url: str) -> tuple[FileSystem, str]:
    """
    Return the file system of a URL, and its path there.

    :raises InputError: where its kind is not known, a package for it is missing, or it has no
        server.
    """
    try:
        from fsspec.core import url_to_fs
    except ModuleNotFoundError as error:
        raise InputError(f"no URLs without {package_of(error)}: {installation('fleet')}") from None
    system: FileSystem
    try:
        if not url.partition('://')[2].strip('/'):
            raise ValueError('it names no server and no file')
        if is_web(url):
            _check_server(url)
            from aick_ros.cli.fleet.web_files import WebFiles
            system, path = WebFiles(), url
        elif _CHAIN in url:
            raise ValueError(f'archives are not unpacked, nor URLs with {_CHAIN} read')
        else:
            options = _options(url)
            system, path = url_to_fs(url, **options)
            if options:
                setattr(system, 'retries', _BUCKET_ATTEMPTS)  # noqa: B010: not of all systems
    except ImportError as error:
        raise InputError(f'{url} needs another package: {_line(error)}') from None
    except ValueError as error:
        raise InputError(f'{url} cannot be read: {_line(error)}') from None
    except (TypeError, AttributeError) as error:
        raise InputError(f'{url} cannot be read: its kind needs more than a URL ({_line(error)})'
                         ) from None
    system.invalidate_cache()  # of lists: they may have changed, and systems are shared
    return system, path.rstrip('/')


def _check_server(url: str) -> None:
    """Raise ValueError where a URL of a web server names none, or none that there can be."""
    parts = urlsplit(url)
    if not parts.hostname:
        raise ValueError('it names no server: write https://SERVER/PATH')
    if parts.port == 0:  # which raises for what is no port
        raise ValueError('its port is 0, at which no server can be: correct it, or leave it out')
    parts.hostname.encode('idna')


def _options(url: str) -> dict[str, object]:
    """Return the limits of S3, which are minutes else; those of fsspec's settings go first."""
    from fsspec.config import conf
    kind = url.partition('://')[0]
    if kind not in _BUCKETS or 'config_kwargs' in conf.get(kind, {}):
        return {}
    return {'config_kwargs': {'connect_timeout': SILENCE_LIMIT, 'read_timeout': SILENCE_LIMIT,
                              'retries': {'total_max_attempts': 1}}}


@contextmanager
def errors_of(url: str) -> Iterator[None]:
    """
    Raise the errors of all file systems as one kind.

    :raises InputError: where there is nothing at the URL.
    :raises TransferError: for any other; SilentServerError where time ran out.
    """
    try:
        yield
    except InputError:
        raise
    except FileNotFoundError as error:
        cause = error.__cause__
        if isinstance(cause, InputError):
            raise cause from None
        if is_web(url) and isinstance(cause, Exception) and not _is_missing(cause):
            raise _transfer_error(url, cause) from None
        raise InputError(f'{url} does not exist') from None
    except Exception as error:  # each file system has its own
        raise _transfer_error(url, error) from None


def _transfer_error(url: str, error: Exception) -> TransferError:
    ran_out = _is_of_time(error) or _is_of_time(error.__cause__)
    return (SilentServerError if ran_out else TransferError)(f'cannot read {url}: {_line(error)}')


def _is_of_time(error: BaseException | None) -> bool:
    """Return whether time ran out; that of S3 has kinds of its own."""
    return isinstance(error, TimeoutError) or type(error).__name__.endswith('TimeoutError')


def _is_missing(cause: Exception) -> bool:
    """Return whether a web server answered that it has no such file, not another error or none."""
    return isinstance(cause, FileNotFoundError) or getattr(cause, 'status', None) == _NOT_FOUND


def _line(error: Exception) -> str:
    if _is_of_time(error) or _is_of_time(error.__cause__):
        return (f"{str(error).strip() or 'nothing arrives any more'}; try later, or copy the "
                'recording yourself')
    if type(error).__name__.endswith('RedirectClientError'):  # of aiohttp; its text is the URL
        return f'it redirects to {error}, which is no URL of a web server'
    lines = (str(error).strip() or type(error).__name__).split('\n')
    first, second = [' '.join(line.split()) for line in [*lines, '']][:2]
    return (f'{first} {second}' if first.endswith(':') else first).rstrip('. ')
