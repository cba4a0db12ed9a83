# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics of frames by a clock that the test moves."""

from types import SimpleNamespace

import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.frame_statistics import FrameStatistics
from aick_ros.ros.health.levels import judge

FRAME = SimpleNamespace(keypoints=(), repeat=Repeat.NONE)


class Frames(FrameStatistics):
    """Frames at 30 Hz."""

    def __init__(self):
        self.now = 100.0
        super().__init__(clock=lambda: self.now)

    def receive(self):
        self.now += 1 / 30
        self.count(Count.RECEIVED)

    def answer(self, count, status=Status.OK, matches=100, total=20.0, frame=FRAME,
               evidence=Evidence.KEYPOINTS):
        """Receive and answer frames, with delays of 10 and 11 ms and ages of 50 and 51 ms."""
        for i in range(count):
            self.receive()
            self.answered(OdometryUpdate(
                1, status, f'{matches} matches', PoseWithCovariance.identity(), frame,
                evidence=evidence, support=matches, timing={'total': total}),
                delay_ms=10.0 + i % 2, age_ms=50.0 + i % 2)

    def damage(self, count):
        """Receive frames that cannot be used."""
        for _ in range(count):
            self.receive()
            self.damaged('wrong size')

    def skip(self, count, reason):
        """Receive frames that are skipped on request."""
        for _ in range(count):
            self.receive()
            self.count(reason)

    def judged(self, complaint='', paused=False, concern=''):
        return judge(self.snapshot(), complaint, paused, concern)


@pytest.fixture
def frames():
    return Frames()
