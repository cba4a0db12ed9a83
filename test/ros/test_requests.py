# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Requests change the odometry when the worker comes to them, and discard what was before."""

import time
from types import SimpleNamespace

import pytest
from rclpy.logging import LoggingSeverity

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.ros.health.counts import Count
from aick_ros.ros.requests import Requests


class Asked:
    """Requests of a node, what they lead to, and the tasks that wait."""

    def __init__(self, graph):
        self.done, self.tasks, self.is_active = [], [], True
        self.node = graph.node()
        self.requests = Requests(
            self.node, 'odom',
            SimpleNamespace(reset=lambda pose: self.done.append(('reset', pose)),
                            set_pose=lambda *how: self.done.append(('set', *how))),
            SimpleNamespace(reset=lambda: self.done.append('outputs'),
                            place_anew=lambda: self.done.append('placed')),
            self.tasks.append, lambda: self.is_active)

    def work(self):
        while self.tasks:
            self.tasks.pop(0)()


@pytest.fixture
def asked(graph):
    return Asked(graph)


POSE = PoseWithCovariance.identity()


@pytest.mark.parametrize('pose', [None, POSE])
def test_a_reset_waits_for_the_worker_and_discards_what_was_paired_before(asked, pose):
    assert asked.requests.discarded_as(time.monotonic()) is None
    asked.requests._reset(pose)
    assert asked.done == []
    assert asked.requests.discarded_as(time.monotonic() - 1.0) is Count.DROPPED_BY_RESET
    asked.work()
    assert asked.done == [('reset', pose), 'outputs']
    assert asked.requests.discarded_as(time.monotonic() + 1.0) is None


@pytest.mark.parametrize('paused, active, is_blind', [
    (False, True, False), (True, True, True), (False, False, True)])
def test_a_pose_is_set_blindly_if_no_frames_were_taken_when_it_was_requested(
        asked, paused, active, is_blind):
    asked.is_active = active
    asked.requests._set_pose(POSE, paused)
    asked.is_active = not active
    asked.work()
    assert asked.done == [('set', POSE, is_blind), 'placed']
    assert asked.requests.discarded_as(time.monotonic() - 1.0) is None


def test_requests_are_confirmed_in_the_log_once_they_are_done(asked, graph):
    asked.requests._reset(None)
    asked.requests._set_pose(POSE, False)
    assert graph.log(asked.node) == []
    asked.work()
    assert graph.log(asked.node) == [
        (LoggingSeverity.INFO, 'odometry reset'), (LoggingSeverity.INFO, 'pose set')]
