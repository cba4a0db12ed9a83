# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The load decides which settings count, and whose change is said."""

from types import SimpleNamespace

import pytest

from aick_ros.ros.load_control import LoadControl
from aick_ros.settings import NodeSettings, Settings
from aick_ros.settings.parameter import with_values


def keypoints(number):
    return with_values(Settings(), {'features.max_keypoints': number})


class Node:
    """A node in whose seconds a third of 30 frames is dropped; what it is told is kept."""

    def __init__(self, monkeypatch, **settings):
        self.applied, self.warnings, self.dropped, self.now = [], [], 0, 1000.0
        monkeypatch.setattr('aick_ros.ros.load_control.time', SimpleNamespace(
            monotonic=lambda: self.now))
        self.load = LoadControl(NodeSettings(**settings), keypoints(400), self.applied.append,
                                self.warnings.append)

    def overload(self, seconds, busy=1.0):
        self.load.update(self.dropped, (busy * self.now,), 0.0)
        for _ in range(seconds):
            for _ in range(30):
                self.load.admits_next()
            self.dropped, self.now = self.dropped + 10, self.now + 1.0
            self.load.update(self.dropped, (busy * self.now,), 0.0)

    @property
    def max_keypoints(self):
        return [settings.features.max_keypoints for settings in self.applied]


@pytest.fixture
def make(monkeypatch):
    return lambda **settings: Node(monkeypatch, **settings)


def test_under_load_half_of_the_keypoints_count_and_it_is_said(make):
    node = make()
    node.overload(1)
    assert (node.applied, node.warnings, node.load.sentence) == ([], [], '')
    node.overload(1)
    assert node.max_keypoints == [200]
    assert node.warnings == [node.load.sentence]
    assert node.load.dropped == 'half of the keypoints'


def test_what_is_computed_less_is_of_the_settings_as_they_are_now(make):
    node = make()
    node.load.change_settings(keypoints(300))
    node.overload(2)
    node.load.change_settings(keypoints(600))
    assert node.max_keypoints == [300, 150, 300]


def test_every_second_frame_is_admitted_at_the_last_step_alone(make):
    node = make()
    assert all(node.load.admits_next() for _ in range(4))
    node.overload(6)
    assert [node.load.admits_next() for _ in range(4)] in (
        [True, False] * 2, [False, True] * 2)


@pytest.mark.parametrize('settings', [{'shed_load': False}, {'process_every_frame': True}])
def test_where_it_is_not_wanted_everything_is_computed_under_load_too(make, settings):
    node = make(**settings)
    node.overload(8)
    assert (node.applied, node.warnings, node.load.dropped) == ([], [], 'nothing')


def test_the_end_of_a_load_is_said_too(make):
    node = make()
    node.overload(2)
    for _ in range(6):
        node.now += 1.0
        node.load.update(node.dropped, (0.0,), 0.0)
    assert node.max_keypoints == [200, 400]
    assert node.warnings[1:] == ['everything is computed again']
    assert node.applied[-1] == keypoints(400)
