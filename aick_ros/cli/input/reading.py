# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A recording as the commands read it: limited, interruptible, as a rule ahead in a thread."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import closing

from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.input.read_ahead import read_ahead
from aick_ros.cli.output.console import say
from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage

COMPLETE = 'complete'
INTERRUPTED = 'interrupted'


class Reading:
    """
    A source that is read until its limit, an error, or Ctrl-C.

    After reading, ``ended`` has the reason of the end: COMPLETE, INTERRUPTED, or the message of an
    error after the first frame. An error before the first frame is raised. Inside a ``with`` block
    the first Ctrl-C ends the reading, which is said at once; elsewhere it ends the program.

    :param limit: maximum number of frames; None: all.
    :param damage: log of unusable images, for several sources with one log.
    :param ahead: read and decode in a thread of its own; False: in that of the caller.
    """

    def __init__(self, source: RgbdSource, limit: int | None,
                 damage: DamageLog | None = None, ahead: bool = True) -> None:
        self.name = source.name
        self.ended = COMPLETE
        self.damage = damage or DamageLog()
        self._source = source
        self._limit = limit
        self._ahead = ahead
        self._interruption = Interruption()

    def __enter__(self) -> Reading:
        """Catch Ctrl-C."""
        self._interruption.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        """Restore the handling of Ctrl-C."""
        self._interruption.__exit__(*error)

    @property
    def ground_truth(self) -> Trajectory | None:
        """True trajectory of the colour camera, or None."""
        return self._source.ground_truth

    @property
    def remarks(self) -> Sequence[str]:
        """Sentences on what of the source was not used, and why."""
        return self._source.remarks

    def __len__(self) -> int:
        """Return the number of frames, or an upper bound."""
        count = len(self._source)
        return count if self._limit is None else min(count, self._limit)

    def say(self, sentence: str) -> None:
        """Print a sentence about the recording for people."""
        say(f'{self.name}: {sentence}')

    def frames(self, on_damaged: OnDamaged = raise_damage) -> Iterator[RgbdFrame]:
        """
        Yield the frames.

        :raises KeyboardInterrupt: after Ctrl-C where there is no frame yet.
        """
        self.ended, count = COMPLETE, 0

        def report(error: InputError) -> None:
            on_damaged(error)
            if self._interruption.requested and not count:
                raise KeyboardInterrupt  # frames may never come
        read = read_ahead if self._ahead else _read
        with closing(read(self._source, report)) as frames:
            try:
                for count, frame in enumerate(frames, 1):
                    yield frame
                    if count == self._limit:
                        return
                    if self._interruption.requested:
                        self.ended = INTERRUPTED
                        say('interrupted: the output is completed up to this point, Ctrl-C again '
                            'ends at once')
                        return
            except InputError as error:
                if not count:
                    raise
                self.ended = str(error)


def _read(source: RgbdSource, on_damaged: OnDamaged) -> Generator[RgbdFrame, None, None]:
    yield from source.frames(on_damaged)
