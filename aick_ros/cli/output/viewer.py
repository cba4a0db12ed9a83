# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The viewer Rerun: in a window, in a browser, or as a file for later."""

from __future__ import annotations

import os
import shlex
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from aick_ros.borders.names import printable
from aick_ros.borders.replacement import replaced
from aick_ros.cli.output.console import say
from aick_ros.errors import InputError, installation, package_of

if TYPE_CHECKING:
    from rerun import RecordingStream

_WEB_PORT, _DATA_PORT = 9090, 9876  # by definition: the defaults of Rerun
_LOOPBACK = '127.0.0.1'
_FULL = 'the disk is full; make room there'
_LEAST_SPACE = 10 ** 6  # bytes; chosen: Rerun hangs where the disk ends within its first ones


@contextmanager
def viewer(name: str, save: Path | None, web: bool) -> Iterator[RecordingStream]:
    """
    Give what to log to: a file, a viewer in a browser, or one in a window.

    :param name: of the recording.
    :raises InputError: where Rerun is missing or has no window, or the file cannot be written.
    """
    os.environ.setdefault('RUST_LOG', 'off')  # lines of Rerun beside the sentence
    try:
        import rerun as rr
    except ModuleNotFoundError as error:
        raise InputError(f"no view without {package_of(error)}: {installation('view')}") from None
    # the draft takes its space from a full disk until replaced() ends: errors are looked at before
    with (replaced(save) if save else nullcontext() as draft, _errors_of(save),
          rr.RecordingStream('aick_ros', recording_id=None) as stream):
        if save is not None and draft is not None:
            _check_file(save)
            stream.save(draft)
        elif web:
            _serve(stream)
        else:
            _open_window(stream)
        stream.send_recording_name(printable(name))
        yield stream
        stream.flush()
    if save is not None and save.is_file():
        say(f'"rerun {shlex.quote(str(save))}" opens what was written')


def _check_file(save: Path) -> None:
    """Raise InputError where Rerun would fail in another way or hang."""
    try:
        str(save.resolve()).encode()
    except UnicodeEncodeError:
        raise InputError(f'cannot write {save}: its name is not UTF-8, choose another one'
                         ) from None
    if _is_full(save):
        raise InputError(f'cannot write {save}: {_FULL}')


def _is_full(save: Path) -> bool:
    """Return whether the disk of a file is full, that which a link leads to."""
    is_direct = save.exists() and not save.is_file()  # what /dev/stdout leads to has no folder
    return shutil.disk_usage((save if is_direct else save.resolve()).parent).free < _LEAST_SPACE


@contextmanager
def _errors_of(save: Path | None) -> Iterator[None]:
    """Raise InputError where Rerun cannot write or serve, also at the end of the block."""
    try:
        yield
    except RuntimeError as error:
        if type(error) is not RuntimeError:
            raise
        what = 'the viewer ended' if save is None else f'cannot write {save}'
        is_full = save is not None and _is_full(save)
        raise InputError(f'{what}: {_FULL if is_full else error}') from None


def _serve(stream: RecordingStream) -> None:
    import rerun as rr
    data = rr.GrpcServerSink(_LOOPBACK, _free_port(_DATA_PORT))
    stream.set_sinks(data)
    port = _free_port(_WEB_PORT)
    rr.serve_web_viewer(web_port=port, open_browser=False)  # to all, but it has no data
    say(f'the viewer is at http://{_LOOPBACK}:{port}/?url={quote(data.uri, safe="")}')


def _free_port(usual: int) -> int:
    """Return a port that no other process has, the usual one where it is free."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as servers do
        try:
            trial.bind(('', usual))
        except OSError:
            trial.bind(('', 0))
        return int(trial.getsockname()[1])


def _open_window(stream: RecordingStream) -> None:
    if not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        raise InputError('there is no display for the window of the viewer: give --web for a '
                         'browser, or --save FILE.rrd')
    stream.spawn()
