# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of the files of a recording at a URL."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from aick_ros.cli.fleet.attempts import asked_again
from aick_ros.cli.fleet.remote import RemoteFile
from aick_ros.cli.fleet.urls import errors_of, open_url
from aick_ros.errors import TransferError

_SLOWEST, _OVER = 1000, 20.0  # bytes per second of all files together, over so many [s]; chosen


@asked_again
def copy(url: str, files: Sequence[RemoteFile], folder: Path,
         new_counter: Callable[[], Callable[[int], None]]) -> None:
    """
    Copy the files of a recording into a folder.

    :param new_counter: called for each attempt; what it returns is called with the number of
        bytes of each piece, and what that raises ends the copy.
    :raises TransferError: where a file did not arrive whole, or slower than is of use.
    """
    for file in files:
        (folder / file.name).parent.mkdir(parents=True, exist_ok=True)
    with errors_of(url):
        system, _ = open_url(url)
        system.get([file.path for file in files], [str(folder / file.name) for file in files],
                   callback=_callback(_paced(url, new_counter())))
    for file in files:
        size = (folder / file.name).stat().st_size
        if file.size is not None and size != file.size:
            raise TransferError(f'cannot copy {url}: {file.name} ended after {size} of '
                                f'{file.size} bytes')


def _paced(url: str, count: Callable[[int], None]) -> Callable[[int], None]:
    """Return a counter that also raises TransferError where bytes hardly arrive."""
    start, arrived = time.monotonic(), 0

    def count_paced(size: int) -> None:
        nonlocal start, arrived
        count(size)
        arrived, passed = arrived + size, time.monotonic() - start
        if passed > _OVER:
            if arrived < _SLOWEST * passed:
                raise TransferError(f'cannot copy {url}: {arrived} bytes arrived in '
                                    f'{passed:.0f} s')
            start, arrived = time.monotonic(), 0
    return count_paced


def _callback(count: Callable[[int], None]) -> object:
    """Return what fsspec reports the bytes of all files to."""
    from fsspec.callbacks import Callback

    class Bytes(Callback):  # type: ignore[misc]  # fsspec has no types

        def relative_update(self, inc: int = 1) -> None:
            count(inc)

    class Files(Callback):  # type: ignore[misc]  # fsspec has no types

        def branched(self, *_: object, **__: object) -> Bytes:
            return Bytes()

    return Files()
