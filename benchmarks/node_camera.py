# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rendered recordings, and the camera that shows them to the node."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from node_process import NodeProcess

from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERAS = {
    '640x480': Camera(640, 480, 525.0, 525.0, 319.5, 239.5),
    '1280x720': Camera(1280, 720, 920.0, 920.0, 639.5, 359.5),
    '1920x1080': Camera(1920, 1080, 1380.0, 1380.0, 959.5, 539.5),
}
FRAMES = 30


@dataclass(frozen=True)
class Plan:
    """Duration and amount of the measurements."""

    folder: Path
    seconds: float
    minutes: float
    damaged: int

    def recording(self, size: str) -> Path:
        """Return a file of rendered frames, as camera.py takes it."""
        path = self.folder / f'{size}.npz'
        if not path.exists():
            source = SyntheticSource(SyntheticOptions(seed=1, frames=FRAMES, camera=CAMERAS[size]))
            frames = [source.frame(i) for i in range(FRAMES)]
            np.savez(path, k=CAMERAS[size].matrix,
                     colour=np.array([frame.colour for frame in frames]),
                     depth=np.array([np.rint(1000 * np.nan_to_num(frame.depth)).astype('<u2')
                                     for frame in frames]))
        return path


def shoot(recording: Path, seconds: float, node: NodeProcess, *options: str) -> tuple[int, float]:
    """Have a camera show a recording; return the frames published and the cores used."""
    with camera(recording, seconds, *options) as process:
        time.sleep(2.5)  # discovery, and the first frames
        begun, cpu = time.monotonic(), node.cpu_seconds
        time.sleep(max(seconds - 2.0, 0.5))
        cores = (node.cpu_seconds - cpu) / (time.monotonic() - begun)
        return int(process.communicate()[0]), cores


@contextmanager
def camera(recording: Path, seconds: float, *options: str) -> Iterator[subprocess.Popen]:
    """Run a camera in a process of its own."""
    script = Path(__file__).with_name('camera.py')
    process = subprocess.Popen([sys.executable, str(script), str(recording), '--seconds',
                                str(seconds), *options], stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()
