# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Reads and decodes frames in a thread of its own, while earlier ones are processed."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator
from dataclasses import dataclass

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.sources import OnDamaged, RgbdSource

_FRAMES_AHEAD = 8  # chosen


def read_ahead(source: RgbdSource, on_damaged: OnDamaged) -> Generator[RgbdFrame, None, None]:
    """
    Yield the frames of a source, which a thread reads ahead.

    Order, reports of damage and errors are those of the source, in the caller's thread.
    """
    reader = _Reader(source)
    reader.start()
    try:
        while (item := reader.items.get()) is not None:
            if isinstance(item, RgbdFrame):
                yield item
            elif isinstance(item, _Damage):
                on_damaged(item.error)
            else:
                raise item
    finally:
        reader.stop()


@dataclass(frozen=True)
class _Damage:
    error: InputError


class _Stopped(Exception):
    """The caller needs no more frames."""


class _Reader(threading.Thread):
    """Fills a queue with frames and damage, then with an exception or None."""

    def __init__(self, source: RgbdSource) -> None:
        super().__init__(name='read_ahead', daemon=True)
        self.items: queue.Queue[RgbdFrame | _Damage | BaseException | None] = queue.Queue(
            _FRAMES_AHEAD)
        self._source = source
        self._stopped = False

    def run(self) -> None:
        end: BaseException | None = None
        try:
            for frame in self._source.frames(lambda error: self._put(_Damage(error))):
                self._put(frame)
        except _Stopped:
            return
        except BaseException as error:
            end = error
        self.items.put(end)

    def stop(self) -> None:
        """End the thread and drop the frames in the queue."""
        self._stopped = True
        while self.is_alive():
            try:
                self.items.get(timeout=0.01)
            except queue.Empty:
                pass

    def _put(self, item: RgbdFrame | _Damage) -> None:
        self.items.put(item)
        if self._stopped:
            raise _Stopped
