# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The step that a process was in when it was lost, and why."""

from __future__ import annotations

import faulthandler
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from aick_ros.evaluation.engine.time_limit import time_limit


@dataclass(frozen=True)
class Loss:
    """
    End of a process in a step.

    :param frames: of the step: none while the method is loaded, one to be prepared, or the two of
        a pair.
    :param reason: of its end.
    """

    frames: tuple[int, ...]
    reason: str


class LastStep:
    """
    A file with the step that this process is in, to which a crash adds its cause.

    Only one may be open in a process.
    """

    def __init__(self, path: Path) -> None:
        self._before = path.read_text('ascii', 'replace') if path.exists() else ''
        self.loss = _loss(self._before)
        self._file = path.open('w', encoding='ascii', errors='replace')

    def __enter__(self) -> LastStep:
        """Let a crash write its cause into the file."""
        faulthandler.enable(self._file, all_threads=False)
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        faulthandler.disable()
        self._file.close()

    def keep_loss(self) -> None:
        """Keep the loss for the next process: the answer of this one may be lost on its way."""
        self._file.write(self._before)

    @contextmanager
    def step(self, limit: float, frames: Sequence[int] = ()) -> Iterator[None]:
        """
        Do a step, in the block.

        :param limit: longest time [s]; beyond it the process ends.
        """
        self._file.write(json.dumps([list(frames), limit]) + '\n')
        self._file.flush()
        try:
            with time_limit(limit, self._file):
                yield
        finally:
            self._file.seek(0)
            self._file.truncate()


def _loss(text: str) -> Loss | None:
    """Return the loss that a file reports; None where there was none, or between two steps."""
    step, _, report = text.partition('\n')
    if not step:
        return None
    frames, limit = json.loads(step)
    cause = report.partition('\n')[0].removeprefix('Fatal Python error: ')
    if cause.startswith('Timeout'):
        return Loss(tuple(frames), f'took longer than {limit:g} s')
    return Loss(tuple(frames), f'crashed ({cause})' if cause else 'was killed')
