# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The warm-up does all that a frame takes."""

import json
import subprocess
import sys

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.settings import Settings
from aick_ros.settings.presets import PRESETS, preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)

LOADED_LATER = """
import json
import sys

import numpy as np
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages.missing_images import MissingImages
from aick_ros.odometry import Odometry
from aick_ros.registration.dynamic_objects import DynamicObjectCheck
from aick_ros.ros.health import diagnostics
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.frame_statistics import FrameStatistics
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.settings import Settings
from aick_ros.settings.presets import preset

camera = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
images = np.load(sys.argv[1])
frames = [RgbdFrame((1 + number) * 33_333_333, colour, depth, camera)
          for number, (colour, depth) in enumerate(zip(images['colour'], images['depth']))]
checked, check = [], DynamicObjectCheck._without_keypoints_of
DynamicObjectCheck._without_keypoints_of = lambda *given: checked.append(1) or check(*given)
warm_up(Settings())
before = set(sys.modules)
for settings in (Settings(), preset('embedded')):
    odometry = Odometry(settings)
    statistics, missing = FrameStatistics(), MissingImages()
    for number, frame in enumerate(frames):
        missing.add(frame.stamp)
        statistics.count(Count.RECEIVED)
        statistics.answered(odometry.register_frame(frame), 10.0 + number, 20.0)
        assert missing.count == 0 and diagnostics.values_of(statistics.snapshot())
print(json.dumps([sorted(set(sys.modules) - before), len(checked)]))
"""


def test_after_it_no_frame_loads_a_module(tmp_path):
    """As NumPy does for np.median and for sets: on a slow computer two frames are lost by it."""
    source = SyntheticSource(SyntheticOptions(seed=5, frames=40, camera=CAMERA))
    frames = [source.frame(index) for index in (0, 1, 2, 3, 4, 20, 21, 22)]  # with a jump
    np.savez(tmp_path / 'images.npz', colour=[frame.colour for frame in frames],
             depth=[frame.depth for frame in frames])
    done = subprocess.run([sys.executable, '-c', LOADED_LATER, tmp_path / 'images.npz'],
                          text=True, check=True, stdout=subprocess.PIPE)
    loaded, checked = json.loads(done.stdout)
    assert loaded == [] and checked


@pytest.mark.parametrize('settings', [Settings(), *map(preset, PRESETS)])
def test_its_frames_are_registered(settings, monkeypatch):
    found, register = [], Odometry.register_frame

    def watch(self, frame):
        update = register(self, frame)
        found.append((update.status, update.prepared.repeat))
    monkeypatch.setattr(Odometry, 'register_frame', watch)
    warm_up(settings)
    assert found == [(Status.FIRST_FRAME, Repeat.NONE), (Status.OK, Repeat.NONE)]
