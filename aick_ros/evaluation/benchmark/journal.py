# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measurements of a benchmark in a file, so that an interrupted run can be resumed.

The file has a line of JSON per prepared frame and per registered pair. The first line identifies
the run: measurements on other data or another machine must not be mixed.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from aick_ros.borders.bounded_json import bounded_json
from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_LIST_BYTES
from aick_ros.borders.replacement import unwritable
from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.evaluation.scores.machine import machine_facts


@dataclass(frozen=True)
class FrameLine:
    """Time that a method needed to prepare a frame."""

    method: str
    recording: str
    frame: int
    milliseconds: float


@dataclass(frozen=True)
class PairLine:
    """
    Result of one registration.

    :param method: identity of the method.
    :param translation: error [m]; None where the registration failed.
    :param rotation: error [rad]; None where the registration failed.
    :param milliseconds: None where the method did not end or was not run.
    :param failure: reason of the failure; '' on success.
    """

    method: str
    recording: str
    pair: FramePair
    translation: float | None
    rotation: float | None
    milliseconds: float | None
    failure: str


Line = FrameLine | PairLine


class Journal:
    """
    The lines of a run, in a file that several processes add to.

    :param path: of a file that :func:`begin` has made.
    """

    def __init__(self, path: Path) -> None:
        self.pairs: dict[tuple[str, str], dict[FramePair, PairLine]] = {}
        self.frames: dict[tuple[str, str], dict[int, float]] = {}
        self.path, self._lines_read, self._bytes_read = path, 0, 0
        self.refresh()

    def add(self, line: Line) -> None:
        """Append a line, in one piece; :meth:`refresh` reads it."""
        with self.path.open('ab', buffering=0) as file:
            file.write(json.dumps(asdict(line)).encode() + b'\n')

    def refresh(self) -> None:
        """
        Read the lines that were added.

        :raises InputError: where one is no result, or the file is gone.
        """
        try:
            with self.path.open('rb') as file:
                file.seek(self._bytes_read)
                while (text := file.readline()).endswith(b'\n'):  # a last one is being written
                    self._lines_read += 1
                    self._bytes_read += len(text)
                    if self._lines_read > 1:
                        self._keep(_parse(self.path, self._lines_read, text))
        except FileNotFoundError:
            raise InputError(f'{self.path} is gone: another benchmark with the same --json has '
                             'ended, or it was removed; start anew') from None

    @property
    def registrations(self) -> int:
        """Number of pairs whose result is known."""
        return sum(map(len, self.pairs.values()))

    def _keep(self, line: Line) -> None:
        key = line.method, line.recording
        if isinstance(line, PairLine):
            self.pairs.setdefault(key, {})[line.pair] = line
        else:
            self.frames.setdefault(key, {})[line.frame] = line.milliseconds


@contextmanager
def reserved(path: Path) -> Iterator[None]:
    """
    Keep other commands from the journal at a path while the block runs.

    :raises InputError: where another one has it, or it cannot be written.
    """
    try:
        # without O_NONBLOCK, opening a pipe waits for a reader
        file = open(path, 'ab', opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    except OSError as error:
        raise unwritable(path, error) from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f'{path} is written by another benchmark: wait until it has ended, '
                             'or give another --json file') from None
        yield


def begin(path: Path, recordings: Sequence[Recording]) -> Journal:
    """
    Return the journal of a run, with the lines of an earlier one that was interrupted.

    :raises InputError: where the file belongs to another run or cannot be written.
    """
    header = json.dumps(_header(recordings))
    try:
        content = read_text(path, 'the results', MAX_LIST_BYTES) if path.exists() else ''
        whole = content[:content.rfind('\n') + 1]  # the last line may be incomplete
        if whole and whole.partition('\n')[0] != header:
            raise InputError(
                f'{path} belongs to a run on other recordings or another machine, with another '
                'mask or other versions: delete it to start anew, or give another --json file')
        if not whole or whole != content:
            path.write_text(whole or header + '\n', encoding='utf-8')
        return Journal(path)
    except OSError as error:
        raise unwritable(path, error) from None


def _header(recordings: Sequence[Recording]) -> dict[str, Any]:
    return {'recordings': {recording.name: _digest(recording) for recording in recordings},
            'machine': machine_facts()}


def _digest(recording: Recording) -> str:
    """Return a text that differs where the stamps do, or what methods see of the frames."""
    mask = None if recording.mask is None else recording.mask.digest
    read = repr((recording.stamps, recording.request.options, mask))
    return hashlib.sha256(read.encode()).hexdigest()[:16]


def _parse(path: Path, number: int, text: bytes) -> Line:
    try:
        content = bounded_json(text.decode())
        line = (PairLine(**{**content, 'pair': FramePair(*content['pair'])}) if 'pair' in content
                else FrameLine(**content))
        _require_types(line)
    except (ValueError, TypeError):
        raise InputError(f'{path}, line {number} is not a result: delete the file to start '
                         'anew') from None
    return line


def _require_types(line: Line) -> None:
    """Raise ValueError where a field is of another type than it is declared as."""
    names = [line.method, line.recording]
    if isinstance(line, PairLine):
        names, frames = [*names, line.failure], [*line.pair]
        measured = (line.milliseconds, line.translation, line.rotation)
        numbers = [number for number in measured if number is not None]
    else:
        frames, numbers = [line.frame], [line.milliseconds]
    # type() is for bool, which is an int
    if not (all(isinstance(name, str) for name in names)
            and all(type(frame) is int and frame >= 0 for frame in frames)
            and all(type(number) in (int, float) for number in numbers)):
        raise ValueError
