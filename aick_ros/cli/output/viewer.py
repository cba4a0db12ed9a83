# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The viewer Rerun: in a window, in a browser, or as a file for later."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from aick_ros.cli.output.console import say
from aick_ros.errors import InputError, installation, package_of

if TYPE_CHECKING:
    from rerun import RecordingStream

_WEB_PORT = 9090  # by definition: the default of Rerun


@contextmanager
def viewer(name: str, save: Path | None, web: bool) -> Iterator[RecordingStream]:
    """
    Give what to log to: a file, a viewer in a browser, or one in a window.

    :param name: of the recording.
    :raises InputError: where Rerun is missing, or has no window.
    """
    try:
        import rerun as rr
    except ModuleNotFoundError as error:
        raise InputError(f"no view without {package_of(error)}: {installation('view')}") from None
    with rr.RecordingStream('aick_ros', recording_id=None) as stream:
        stream.send_recording_name(name)
        if save is not None:
            stream.save(save)
        elif web:
            _serve(stream)
        else:
            _open_window(stream)
        yield stream
        stream.flush()


def _serve(stream: RecordingStream) -> None:
    import rerun as rr
    data = stream.serve_grpc()
    rr.serve_web_viewer(web_port=_WEB_PORT, open_browser=False)
    say(f'the viewer is at http://127.0.0.1:{_WEB_PORT}/?url={quote(data, safe="")}')


def _open_window(stream: RecordingStream) -> None:
    if not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        raise InputError('there is no display for the window of the viewer: give --web for a '
                         'browser, or --save FILE.rrd')
    stream.spawn()
