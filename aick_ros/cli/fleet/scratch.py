# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The scratch space of a worker: copies of recordings that lie elsewhere."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from aick_ros.cli.fleet.remote import RemoteFile, files_of
from aick_ros.cli.fleet.transfer import copy
from aick_ros.cli.fleet.urls import name_of
from aick_ros.errors import InputError

_MB = 1e6


@dataclass(frozen=True)
class ScratchSpace:
    """
    What a fleet may use of each worker.

    :param fleet: name of the fleet, which no other has.
    :param limit: most bytes of all copies of a worker.
    """

    fleet: str = field(default_factory=lambda: uuid.uuid4().hex)
    limit: int = 10 ** 10


@dataclass(frozen=True)
class Copy:
    """
    A recording on this machine.

    :param bytes_copied: 0 where the copy was there already.
    """

    path: Path
    bytes_copied: int


class Scratch:
    """
    Copies of recordings; those that were used least recently make room for others.

    :param folder: of its own; it is made with the first copy.
    :param limit: most bytes of all copies.
    """

    def __init__(self, folder: Path, limit: int) -> None:
        self._folder, self._limit = folder, limit
        self._sizes = dict[Path, int]()  # least recently used first
        self._in_use = threading.Lock()
        self._is_removed = False

    @contextmanager
    def copy_of(self, url: str) -> Iterator[Copy]:
        """
        Copy a recording, unless the copy is there; it is kept while the block runs.

        :raises InputError: where there is no recording, or it is larger than the limit.
        :raises TransferError: where it did not arrive whole.
        """
        with self._in_use:  # a process has one task at a time, but for one that was cancelled
            self._reject_after_the_end(url)
            try:
                yield self._copy_of(url)
            finally:
                if self._is_removed:
                    self.remove()  # what has been made since

    def remove(self) -> None:
        """Remove all copies, that in use included; a transfer ends."""
        self._is_removed = True
        shutil.rmtree(self._folder, ignore_errors=True)

    def _copy_of(self, url: str) -> Copy:
        files = files_of(url)
        folder = self._folder / hashlib.sha256(repr((url, files)).encode()).hexdigest()[:32]
        there = self._sizes.pop(folder, None)
        copied = 0 if there is not None else self._copy(url, files, folder)
        self._sizes[folder] = there or copied
        return Copy(folder / name_of(url), copied)

    def _copy(self, url: str, files: Sequence[RemoteFile], folder: Path) -> int:
        """Copy a recording into a folder, whole or not at all, and return its size in bytes."""
        self._make_room(url, sum(file.size or 0 for file in files))
        folder.mkdir(parents=True)
        try:
            copy(url, files, folder, lambda: self._counter(url))
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return sum((folder / file.name).stat().st_size for file in files)

    def _make_room(self, url: str, size: int) -> None:
        if size > self._limit:
            raise InputError(f'{url} has more than the {self._limit / _MB:g} MB that '
                             '--scratch-limit allows')
        while sum(self._sizes.values()) + size > self._limit:
            oldest = next(iter(self._sizes))
            del self._sizes[oldest]
            shutil.rmtree(oldest, ignore_errors=True)

    def _counter(self, url: str) -> Callable[[int], None]:
        """Return what keeps the limit where more arrives than was announced."""
        self._reject_after_the_end(url)
        arrived = 0

        def count(size: int) -> None:
            nonlocal arrived
            arrived += size
            self._make_room(url, arrived)
            self._reject_after_the_end(url)
        return count

    def _reject_after_the_end(self, url: str) -> None:
        if self._is_removed:
            raise InputError(f'cannot copy {url}: the fleet has ended')


_scratches: dict[str, Scratch] = {}
"""By name of the fleet."""


def scratch_of(space: ScratchSpace) -> Scratch:
    """Return the scratch space of a fleet in this process."""
    if space.fleet not in _scratches:
        _scratches[space.fleet] = Scratch(worker_folder() / f'aick-{space.fleet}', space.limit)
    return _scratches[space.fleet]


def remove_scratch(fleet: str) -> None:
    """Remove what a fleet has copied in this process."""
    if fleet in _scratches:
        _scratches[fleet].remove()


def worker_folder() -> Path:
    """Return the folder of a worker, which Dask removes with it, even after a SIGKILL."""
    from distributed import get_worker
    try:
        return Path(get_worker().local_directory)
    except ValueError:
        return Path(tempfile.gettempdir())
