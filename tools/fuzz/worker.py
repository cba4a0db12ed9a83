# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""One input after another through a target, watched for anything but InputError."""

from __future__ import annotations

import gc
import os
import re
import resource
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import cv2

from aick_ros.errors import InputError

Target = Callable[[bytes, Path], None]
"""Uses an input; the folder is for its files, and empty."""

_MOST_MEMORY = 2 ** 30  # bytes that one input may take
_MOST_SECONDS = 5.0  # of CPU time that one input may take


class Outcome(NamedTuple):
    """
    What a target made of an input.

    :param finding: name of the kind of failure; '' where there is none.
    :param text: the sentence of an InputError, or the traceback of a failure.
    """

    finding: str
    text: str

    @property
    def kind(self) -> str:
        """The text without what differs from input to input."""
        return self.finding or re.sub(r"'.*?'|\S*\d\S*|/\S+", '#', self.text)[:120]


class Worker:
    """
    Runs a target; make it in a process of its own, whose memory it limits.

    :param folder: for the files of the target.
    :param may_print: whether the codecs of OpenCV are used, which print of damage.
    """

    def __init__(self, target: Target, folder: Path, may_print: bool = False) -> None:
        self._target, self._folder, self._may_print = target, folder, may_print
        cv2.setNumThreads(1)
        warnings.simplefilter('error')  # they would stand beside the sentence
        limit = _memory('VmSize') + _MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def run(self, data: bytes) -> Outcome:
        """Run one input."""
        start = time.process_time()
        with tempfile.TemporaryDirectory(dir=self._folder) as folder, _printed() as printed:
            outcome = self._outcome(data, Path(folder))
            noise = printed()
        if outcome.finding:
            return outcome
        if noise and not self._may_print:
            return Outcome('printed', noise)
        if time.process_time() - start > _MOST_SECONDS:
            return Outcome('slow', f'{time.process_time() - start:.1f} s of CPU time')
        return outcome

    def _outcome(self, data: bytes, folder: Path) -> Outcome:
        try:
            self._target(data, folder)
        except InputError as error:
            return Outcome('', str(error))
        except Exception as error:
            frames = [frame for frame in traceback.extract_tb(error.__traceback__)
                      if '/aick_ros/' in frame.filename]
            place = f'-{Path(frames[-1].filename).stem}-{frames[-1].name}' if frames else ''
            return Outcome(f'{type(error).__name__}{place}', traceback.format_exc())
        return Outcome('', '')


def resident_memory() -> int:
    """Return the memory that this process holds [byte]."""
    gc.collect()
    return _memory('VmRSS')


def cpu_time(process: int | None) -> float:
    """Return the CPU time that a process has used [s]; 0: it has ended."""
    try:
        fields = Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def _memory(name: str) -> int:
    status = Path('/proc/self/status').read_text()
    return 1024 * int(status.split(f'{name}:')[1].split()[0])


@contextmanager
def _printed() -> Iterator[Callable[[], str]]:
    """Keep what is printed on stderr, also by C libraries."""
    kept = os.dup(2)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)

        def content() -> str:
            file.seek(0)
            return file.read(2000).decode(errors='replace')
        try:
            yield content
        finally:
            os.dup2(kept, 2)
            os.close(kept)
