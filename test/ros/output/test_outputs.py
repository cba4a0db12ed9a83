# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Outputs of a frame: all of them, or only what is for display."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.ros.output.outputs import Outputs
from aick_ros.ros.robot_odometry import RobotUpdate
from aick_ros.settings import NodeSettings

T_ODOM_BASE, T_BASE_CAMERA = np.eye(4), np.eye(4)


@pytest.fixture
def outputs(graph, monkeypatch):
    """Return outputs and the list of what their parts do."""
    made, done = Outputs(graph.node(), NodeSettings(), None, lambda: np.empty((0, 3))), []

    def part(name):
        return SimpleNamespace(**{verb: lambda *given, verb=verb: done.append((name, verb, *given))
                                  for verb in ('publish', 'show', 'reset')})
    for name in ('publisher', 'views', 'rtabmap'):
        monkeypatch.setattr(made, f'_{name}', part(name))
    return made, done


def test_a_frame_is_published_before_it_is_shown(outputs):
    made, done = outputs
    update = RobotUpdate('frame', 'optical', 'camera', 'base', T_ODOM_BASE, T_BASE_CAMERA)
    made.publish(update)
    assert done == [('publisher', 'publish', 'base'), ('rtabmap', 'show', update, 'base')]
    made.show(update)
    assert done[2:] == [('views', 'show', 'frame', 'camera', T_ODOM_BASE, T_BASE_CAMERA,
                         'optical')]


def test_a_frame_without_an_update_of_the_base_is_only_shown(outputs):
    made, done = outputs
    update = RobotUpdate('frame', 'optical', 'camera', None, T_ODOM_BASE, T_BASE_CAMERA)
    made.publish(update)
    made.show(update)
    assert [name for name, *_ in done] == ['views']


def test_a_base_that_is_placed_anew_keeps_its_path_and_a_reset_does_not(outputs):
    made, done = outputs
    made.place_anew()
    assert done == [('publisher', 'reset')]
    made.reset()
    assert done[1:] == [(name, 'reset') for name in ('publisher', 'views', 'rtabmap')]
