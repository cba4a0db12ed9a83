# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What it brings to prepare a frame on one thread while the one before is registered on another.

    python benchmarks/overlap.py SOURCE [--frames 100] [--preset NAME]

Frames go through both halves in turn, then through two threads. Time in which a thread is ready
but the machine runs something else is not counted (Linux reports it), so that a busy machine
shows what two idle cores would: the interval of frames is the time of the slower half, with its
waits for the interpreter's lock.
"""

from __future__ import annotations

import argparse
import queue
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.registration.preparation import Preparation
from aick_ros.settings import Settings
from aick_ros.settings.presets import preset
from aick_ros.sources import open_source, raise_damage


@dataclass
class Half:
    """The time of one half [s]: of the processor, and of waits for anything but a core."""

    processor: float = 0.0
    waiting: float = 0.0

    def run(self, work, *arguments):
        """Return the result of work, and add its time."""
        running, ready, start = *_scheduled(), time.monotonic()
        result = work(*arguments)
        elapsed = time.monotonic() - start
        ran, waited = np.subtract(_scheduled(), (running, ready))
        self.processor += ran
        self.waiting += elapsed - ran - waited
        return result


def _scheduled() -> tuple[float, float]:
    """Return the time that this thread ran, and that it waited for a core [s]."""
    numbers = Path(f'/proc/self/task/{threading.get_native_id()}/schedstat').read_text().split()
    return 1e-9 * int(numbers[0]), 1e-9 * int(numbers[1])


def in_turn(odometry: Odometry, frames: Iterable[RgbdFrame],
            halves: Sequence[Half]) -> list[OdometryUpdate]:
    """Return the updates of frames that are prepared and registered on this thread."""
    first, second = halves
    return [second.run(odometry.register, first.run(odometry.prepare, frame))
            for frame in frames]


def overlapping(odometry: Odometry, frames: Sequence[RgbdFrame],
                halves: Sequence[Half]) -> list[OdometryUpdate]:
    """Return the updates of frames that are prepared on another thread, one ahead."""
    first, second = halves
    waiting: queue.Queue[Preparation] = queue.Queue(1)
    thread = threading.Thread(target=lambda: [
        waiting.put(first.run(odometry.prepare, frame)) for frame in frames])
    thread.start()
    updates = [second.run(odometry.register, waiting.get()) for _ in frames]
    thread.join()
    return updates


def main() -> None:
    """Print the time of a frame, in turn and overlapping."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('source')
    parser.add_argument('--frames', type=int, default=100)
    parser.add_argument('--preset')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    settings = preset(options.preset) if options.preset else Settings()
    frames = [frame for frame, _ in zip(open_source(options.source).frames(raise_damage),
                                        range(options.frames))]
    paths = []
    for way in (in_turn, overlapping):
        halves = Half(), Half()
        updates = way(Odometry(settings), frames, halves)
        paths.append(np.array([update.T_odom_camera for update in updates]))
        times = [1e3 * (half.processor + half.waiting) / len(frames) for half in halves]
        interval = sum(times) if way is in_turn else max(times)
        print(f'{way.__name__}: prepare {times[0]:.1f} ms, register {times[1]:.1f} ms (of these '
              f'{1e3 * sum(half.waiting for half in halves) / len(frames):.1f} ms of waiting): a '
              f'frame every {interval:.1f} ms')
    print('answers are equal' if np.array_equal(*paths) else 'ANSWERS DIFFER')


if __name__ == '__main__':
    main()
