# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The warm-up does all that a frame takes."""

import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.settings import Settings
from aick_ros.settings.presets import PRESETS, preset


@pytest.mark.parametrize('settings', [Settings(), *map(preset, PRESETS)])
def test_its_frames_are_registered(settings, monkeypatch):
    found, register = [], Odometry.register_frame

    def watch(self, frame):
        update = register(self, frame)
        found.append((update.status, update.prepared.repeat))
    monkeypatch.setattr(Odometry, 'register_frame', watch)
    warm_up(settings)
    assert found == [(Status.FIRST_FRAME, Repeat.NONE), (Status.OK, Repeat.NONE)]
