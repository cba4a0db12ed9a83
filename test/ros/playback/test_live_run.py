# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A run of a node that is played: which images and answers are its own, and what ends it."""

from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from aick_ros.errors import InputError
from aick_ros.ros.playback import live_run
from aick_ros.ros.playback.bag_player import Played

BAG = Path('some.bag')
REMAPPINGS = {'rgb/image': '/colour', 'depth/image': '/depth', 'rgb/camera_info': '/info'}


class Stage:
    """
    The bag, the node and ROS, as they are played.

    :ivar done: what was done, in order.
    """

    def __init__(self):
        self.done, self.topics = [], ['/colour', '/depth', '/info', '/imu']
        self.exit_code, self.heard, self.subscribed = None, True, True
        self.answers = [SimpleNamespace(stamp=stamp) for stamp in (10, 99, 20)]
        self.played = [Played('/info', None, 0.5), Played('/colour', 10, 1.0),
                       Played('/depth', 11, 1.5), Played('/colour', 20, 2.0),
                       Played('/colour', None, 3.0), Played('/depth', 21, 3.5)]

    def poll(self):
        return self.exit_code

    @contextmanager
    def process(self, *arguments):
        self.done.append(('started', *arguments))
        yield self
        self.done.append('ended')

    @contextmanager
    def listening(self):
        yield self

    def player(self, bag):
        assert bag == BAG
        return self

    def play(self, pace):
        self.done.append(('played', pace))
        yield from self.played

    def has_subscribers(self, topics):
        assert list(topics) == list(REMAPPINGS.values())
        return self.subscribed

    def wait_for_answers(self, stamps):
        self.done.append(('awaited', list(stamps)))


@pytest.fixture
def stage(monkeypatch):
    stage = Stage()
    for name, part in {
            'node_process': stage.process, 'listening': stage.listening,
            'BagPlayer': stage.player, 'initialise': lambda arguments, **_: None,
            'use_fastdds_profile': lambda: stage.done.append('profile'),
            'wait_until': lambda condition, timeout: condition()}.items():
        monkeypatch.setattr(live_run, name, part)
    monkeypatch.setattr(live_run.rclpy, 'try_shutdown', lambda: stage.done.append('shut down'))
    return stage


def test_colour_images_are_published_and_answered(stage):
    counts = []
    run = live_run.run_live(BAG, REMAPPINGS, {'x': 1}, 'pace', ['node'], counts.append)
    assert run.published_at == {10: 1.0, 20: 2.0} and counts == [1, 2]
    assert [answer.stamp for answer in run.answers] == [10, 20]
    assert stage.done == ['profile', ('started', ['node'], REMAPPINGS, {'x': 1}),
                          ('played', 'pace'), ('awaited', [10, 20]), 'ended', 'shut down']


@pytest.mark.parametrize('state, sentence', [
    ({'topics': ['/colour', '/tf']}, 'some.bag has no topic /depth, /info'),
    ({'exit_code': 0}, 'odom_node ended at once with exit code 0'),
    ({'exit_code': 2}, 'odom_node ended at once with exit code 2'),
    ({'heard': False}, 'odom_node did not start within 60 s'),
    ({'subscribed': False}, 'odom_node did not start within 60 s')])
def test_a_node_that_is_not_ready_is_not_played_to(stage, state, sentence):
    vars(stage).update(state)
    with pytest.raises(InputError, match=f'^{sentence}$'):
        live_run.run_live(BAG, REMAPPINGS, {}, 'pace')
    assert stage.done[-1] == 'shut down'
    assert not any(done[0] == 'played' for done in stage.done)


def test_the_wait_ends_as_soon_as_the_node_is_ready_or_has_ended(stage, monkeypatch):
    answers = []

    def wait_until(condition, timeout):
        for exit_code, heard, subscribed in ((None, False, False), (None, True, False),
                                             (None, False, True), (3, False, False)):
            stage.exit_code, stage.heard, stage.subscribed = exit_code, heard, subscribed
            answers.append(condition())
        stage.exit_code, stage.heard, stage.subscribed = None, True, True
        answers.append(condition())

    monkeypatch.setattr(live_run, 'wait_until', wait_until)
    live_run.run_live(BAG, REMAPPINGS, {}, 'pace')
    assert answers == [False, False, False, True, True]
