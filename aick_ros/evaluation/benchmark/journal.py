# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measurements of a benchmark in a file, so that an interrupted run can be resumed.

The file has a line of JSON per prepared frame and per registered pair. The first line identifies
the run: measurements on other data or another machine must not be mixed.
"""

from __future__ import annotations

import hashlib
import json
import math
import threading
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TextIO

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_LIST_BYTES
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
    The lines of a run, in memory and optionally in a file.

    :param path: None: in memory only.
    :param recordings: recordings of the run.
    :raises InputError: where the file belongs to another run or cannot be written.
    """

    def __init__(self, path: Path | None, recordings: Sequence[Recording]) -> None:
        self.pairs: dict[tuple[str, str], dict[FramePair, PairLine]] = {}
        self.frames: dict[tuple[str, str], dict[int, float]] = {}
        self.lines_found = 0
        self._path, self._lock = path, threading.Lock()
        self._file: TextIO | None = None
        if path is None:
            return
        header = json.dumps(_header(recordings))
        try:
            if path.exists():
                self._read(path, header)
            self._file = path.open('a', encoding='utf-8')
            if not self._file.tell():
                self._write(header)
        except OSError as error:
            raise InputError(f'cannot write {path}: {error.strerror}') from None

    def add(self, line: Line) -> None:
        """Store a line; may be called from any thread."""
        with self._lock:
            self._keep(line)
            self._write(json.dumps(asdict(line)))

    def close(self) -> None:
        """Close the file, for the next run."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def delete(self) -> None:
        """Remove the file, as the run is complete."""
        self.close()
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def _keep(self, line: Line) -> None:
        key = line.method, line.recording
        if isinstance(line, PairLine):
            self.pairs.setdefault(key, {})[line.pair] = line
        else:
            self.frames.setdefault(key, {})[line.frame] = line.milliseconds

    def _write(self, text: str) -> None:
        if self._file is not None:
            self._file.write(text + '\n')
            self._file.flush()

    def _read(self, path: Path, header: str) -> None:
        """Read the lines of an earlier run; an incomplete last line is removed."""
        content = read_text(path, 'the results', MAX_LIST_BYTES)
        whole = content[:content.rfind('\n') + 1]
        lines = whole.split('\n')[:-1]
        if lines and lines[0] != header:
            raise InputError(
                f'{path} belongs to a run on other recordings, another machine or other versions: '
                'delete it to start anew, or give another --json file')
        for number, text in enumerate(lines[1:], 2):
            self._keep(_parse(path, number, text))
        self.lines_found = max(len(lines) - 1, 0)
        if whole != content:
            path.write_text(whole, encoding='utf-8')


def _header(recordings: Sequence[Recording]) -> dict[str, Any]:
    stamps = {recording.name: hashlib.sha256(repr(recording.stamps).encode()).hexdigest()[:16]
              for recording in recordings}
    return {'recordings': stamps, 'machine': machine_facts()}


def _parse(path: Path, number: int, text: str) -> Line:
    try:
        content = json.loads(text)
        line = (PairLine(**{**content, 'pair': FramePair(*content['pair'])}) if 'pair' in content
                else FrameLine(**content))
        _require_types(line)
    except (ValueError, TypeError, RecursionError, OverflowError):
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
            and all(type(number) is not bool and math.isfinite(number) for number in numbers)):
        raise ValueError
