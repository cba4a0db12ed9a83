# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of the files of a recording at a URL."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from aick_ros.cli.fleet.attempts import asked_again
from aick_ros.cli.fleet.pace import Pace, SilentServerError
from aick_ros.cli.fleet.remote import RemoteFile
from aick_ros.cli.fleet.urls import errors_of, open_url
from aick_ros.errors import TransferError


@asked_again
def copy(url: str, files: Sequence[RemoteFile], folder: Path,
         new_counter: Callable[[], Callable[[int], None]]) -> None:
    """
    Copy the files of a recording into a folder.

    :param new_counter: called for each attempt; what it returns is called with the number of
        bytes of each piece, and what that raises ends the copy.
    :raises TransferError: where a file did not arrive whole; SilentServerError where it hardly
        arrives from the beginning.
    """
    for file in files:
        (folder / file.name).parent.mkdir(parents=True, exist_ok=True)
    pace = Pace(url)
    try:
        with errors_of(url):
            system, _ = open_url(url)
            system.get([file.path for file in files], [str(folder / file.name) for file in files],
                       callback=_callback(new_counter(), pace.add))
    except SilentServerError as error:
        raise TransferError(str(error)) if pace.was_kept else error from None
    for file in files:
        size = (folder / file.name).stat().st_size
        if file.size is not None and size != file.size:
            raise TransferError(f'cannot copy {url}: {file.name} ended after {size} of '
                                f'{file.size} bytes')


def _callback(*counters: Callable[[int], None]) -> object:
    """Return what fsspec reports the bytes of all files to; it passes them to the counters."""
    from fsspec.callbacks import Callback

    class Bytes(Callback):  # type: ignore[misc]  # fsspec has no types

        def relative_update(self, inc: int = 1) -> None:
            for count in counters:
                count(inc)

    class Files(Callback):  # type: ignore[misc]  # fsspec has no types

        def branched(self, *_: object, **__: object) -> Bytes:
            return Bytes()

    return Files()
