# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A Python module in a process of its own that answers one JSON request with lines of JSON.

It may crash or hang: its output is read in a thread, so that waiting for an answer can be limited.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from aick_ros.borders.parent import supervised

ONE_THREAD = {name: '1' for name in (
    'OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMEXPR_NUM_THREADS')}

_POLL_INTERVAL = 0.1  # [s] between two checks whether the user stops; chosen
_LONGEST_MESSAGE = 200  # characters of an error message that are shown; chosen


class JsonProcess:
    """
    The process; a context manager that kills it at the end, with all that it has started.

    :param module: run as ``python -m``, with this package on its path and single-threaded BLAS.
    :param request: sent as one line of JSON to its standard input.
    """

    def __init__(self, module: str, request: object) -> None:
        self._errors = tempfile.TemporaryFile()
        package = str(Path(__file__).parents[3])
        path = os.pathsep.join(filter(None, (package, os.environ.get('PYTHONPATH'))))
        self._process = subprocess.Popen(
            [sys.executable, '-m', module],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            env={**supervised(), **ONE_THREAD, 'PYTHONPATH': path},
            start_new_session=True)  # Ctrl-C must not reach it; it becomes a group to be killed
        assert self._process.stdin is not None and self._process.stdout is not None
        self._output = self._process.stdout
        with self._process.stdin as stream:
            stream.write(json.dumps(request).encode() + b'\n')
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        threading.Thread(target=_read, args=(self._output, self._lines), daemon=True).start()

    def __enter__(self) -> JsonProcess:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Kill the process and its children."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._output.close()
        self._errors.close()

    def next(self, limit: float, is_stopped: Callable[[], bool]) -> dict[str, Any] | None:
        """
        Return the next answer; None after the last one and once ``is_stopped()``.

        :param limit: longest wait [s].
        :raises TimeoutError: after that.
        """
        end = time.monotonic() + limit
        while not is_stopped():
            try:
                line = self._lines.get(timeout=_POLL_INTERVAL)
            except queue.Empty:
                if time.monotonic() > end:
                    raise TimeoutError(f'took longer than {limit:g} s') from None
                continue
            if line is None:
                return None
            answer: dict[str, Any] = json.loads(line)
            return answer
        return None

    def cause_of_exit(self) -> str:
        """Return the signal that ended the process, or its exit code and last error message."""
        code = self._process.wait()
        if code < 0:
            return signal.Signals(-code).name
        self._errors.seek(0)
        last = self._errors.read().decode(errors='replace').strip().rpartition('\n')[2]
        return f'exit code {code}: {last[:_LONGEST_MESSAGE]}'


def _read(stream: IO[bytes], lines: queue.Queue[bytes | None]) -> None:
    """Put the lines of a stream into a queue, and None after the last."""
    try:
        for line in stream:
            lines.put(line)
    except ValueError:
        pass  # the stream was closed while it was read
    lines.put(None)
