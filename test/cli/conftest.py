# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command run inside the test, and a small rendered recording."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest

from aick_ros.cli import main
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.camera import Camera
from aick_ros.reports import canvas
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

FRAMES = 14


@dataclass
class Outcome:
    """Exit code and output of a command."""

    code: int
    out: str
    err: str

    @property
    def sentence(self):
        """The one line on standard error."""
        assert self.err.startswith('aick: ')
        assert self.err.endswith('\n')
        assert self.err.count('\n') == 1
        return self.err.removeprefix('aick: ').rstrip()


@pytest.fixture
def aick(capfd, tmp_path, monkeypatch):
    """Return a function that runs the command in a folder of its own."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        capfd.readouterr()
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        return Outcome(end.value.code, *capfd.readouterr())

    return run


@pytest.fixture(autouse=True)
def draw(monkeypatch):
    """Let pictures of reports be empty, to draw which takes a second; return what draws them."""
    drawn = canvas.to_svg
    monkeypatch.setattr(canvas, 'to_svg', lambda figure: '<svg></svg>')
    return drawn


class InMemory:
    """
    An RgbdSource of frames in memory.

    :param on_frame: called before each frame with its index; what it raises breaks the source.
    """

    def __init__(self, recorded, ground_truth=None, on_frame=lambda index, on_damaged: None):
        self.name, self.ground_truth, self.remarks = 'in memory', ground_truth, ()
        self._recorded, self._on_frame = recorded, on_frame

    def __len__(self):
        return len(self._recorded)

    def frames(self, on_damaged):
        for index, frame in enumerate(self._recorded):
            self._on_frame(index, on_damaged)
            yield frame


@pytest.fixture(scope='session')
def in_memory():
    """Return the class of sources in memory."""
    return InMemory


@pytest.fixture(scope='session')
def recording():
    """Return a rendered recording of a second, kept in memory."""
    rendered = SyntheticSource(SyntheticOptions(
        seed=2, frames=FRAMES, rate=12.0, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5)))
    return InMemory(list(rendered.frames(raise_damage)), rendered.ground_truth)


@pytest.fixture(scope='session')
def pushed(recording):
    """Return frames with an accelerometer that is pushed before the first one alone."""
    frames = []
    for frame in list(recording.frames(raise_damage))[:5]:
        forces = np.column_stack([np.full(16, 0.0 if frames else 3.0), np.full(16, -9.8),
                                  0.01 * np.arange(16)])
        frames.append(dataclasses.replace(frame, imu=ImuSamples(
            frame.stamp - np.arange(16, dtype=np.int64)[::-1] * 5_000_000,
            np.full((16, 3), np.nan), forces)))
    return frames


@pytest.fixture(scope='session')
def stuck(recording):
    """Return frames with an accelerometer that is stuck, of an IMU without a gyroscope."""
    return [dataclasses.replace(frame, imu=ImuSamples(
        frame.stamp - np.arange(8, dtype=np.int64)[::-1] * 10_000_000,
        np.full((8, 3), np.nan), np.tile([0.0, -9.8, 0.5], (8, 1))))
        for frame in recording.frames(raise_damage)]
