# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parts of a registration that answer as they are told, and frames of which little is known."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.registration.status import Status
from aick_ros.registration.tracks import Tracks
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(12, 10, 10.0, 10.0, 5.5, 4.5)


class Part:
    """A part that notes its questions, and answers each kind by a value or by a function."""

    def __init__(self, parts, name, made_with=()):
        self._parts, self._name, self.made_with = parts, name, made_with

    def __getattr__(self, method):
        if method.startswith('__'):
            raise AttributeError(method)

        def ask(*args, **named):
            self._parts.log.append((self._name, method, (*args, *named.values())))
            answer = self._parts.answers[self._name, method]
            return answer(*args, **named) if callable(answer) else answer
        return ask


class Parts:
    """
    Parts that stand for classes of a module.

    :ivar made: lists of the parts by their classes; each knows what it was made with.
    :ivar answers: by (class, method); ``log``: (class, method, arguments) of each question.
    """

    def __init__(self, monkeypatch):
        self._monkeypatch = monkeypatch
        self.made, self.log, self.answers = {}, [], {}

    def replace(self, module, *names):
        for name in names:
            self._monkeypatch.setattr(
                f'aick_ros.registration.{module}.{name}',
                lambda *args, _name=name, **named: self.make(_name, (*args, *named.values())))

    def make(self, name, made_with=()):
        """Return a part that stands for a class."""
        self.made.setdefault(name, []).append(Part(self, name, made_with))
        return self.made[name][-1]

    def asked(self, name, method):
        """Return the arguments of all questions of a kind, oldest first."""
        return [args for part, asked, args in self.log if (part, asked) == (name, method)]

    def order(self):
        """Return (class, method) of all questions."""
        return [question[:2] for question in self.log]


class Made:
    """Frames and results with random contents, none like another."""

    def __init__(self):
        self._rng = np.random.default_rng(8)

    def pose(self, scale=0.1):
        return se3.exp(scale * self._rng.standard_normal(6))

    def covariance(self):
        root = 0.01 * self._rng.standard_normal((6, 6))
        return root @ root.T

    def frame(self, stamp, size=(10, 12)):
        rows, columns = size
        return RgbdFrame(stamp, self._rng.integers(0, 255, size, np.uint8),
                         np.ones(size, np.float32),
                         dataclasses.replace(CAMERA, width=columns, height=rows))

    def keypoints(self, stamp, count):
        return KeypointFrame(
            stamp, self._rng.uniform(1.0, 3.0, (count, 3)),
            self._rng.integers(0, 255, (count, 32), np.uint8),
            np.tile(1e-4 * np.eye(3), (count, 1, 1)), 100 * np.arange(2 * count).reshape(-1, 2))

    def prepared(self, stamp, count=100, size=(10, 12), **values):
        frame = self.frame(stamp, size)
        return PreparedFrame(frame, self.keypoints(stamp, count), frame.grey, **values)

    def tracks(self, count):
        return Tracks(np.arange(count), self._rng.uniform(1.0, 3.0, (count, 3)),
                      self._rng.uniform(-0.5, 0.5, (count, 2)), np.ones(count), np.ones(count))

    def refined(self, tracked, **values):
        return Refined(self.pose(), self.covariance(), self.covariance(), self.tracks(tracked),
                       **values)

    def registration(self, status=Status.OK, reason='as told', count=70, **values):
        return Registration(
            status, reason, self.pose(), self.covariance(),
            np.column_stack([np.arange(count), np.arange(count)]), 7, count, **values)


@pytest.fixture
def parts(monkeypatch):
    """Return parts, which stand for the classes that a test names."""
    return Parts(monkeypatch)


@pytest.fixture
def made():
    """Return the maker of frames and results."""
    return Made()


@pytest.fixture(scope='session')
def rendered_views():
    """Return a registrar, a view prepared for tracking, a keyframe, and the exact motion."""
    source = SyntheticSource(SyntheticOptions.perfect(
        seed=5, frames=16, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5)))
    registrar = Registrar()
    keyframe, frame = source.frame(0), source.frame(3)
    poses = [source.ground_truth.at(stamp, 0.0) for stamp in (keyframe.stamp, frame.stamp)]
    tracked = registrar.prepared_for_tracking(registrar.preparer.begin(frame))
    return registrar, tracked, registrar.prepare(keyframe), se3.inverse(poses[0]) @ poses[1]
