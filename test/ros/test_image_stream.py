# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is tended, said and closed on a node, by inputs that keep what is asked of them."""

from types import SimpleNamespace

import pytest
from rclpy.clock_type import ClockType

from aick_ros.ros import image_stream
from aick_ros.ros.image_stream import ImageStream
from aick_ros.settings.node import NodeSettings


class Input:
    """A subscription, or anything else that is tended."""

    def __init__(self, name):
        self.name, self.tended, self.is_closed = name, 0, False

    def adapt(self):
        self.tended += 1

    tend = adapt

    def close(self):
        self.is_closed = True


class World(SimpleNamespace):
    """The pairing and the watchdog of a stream on a node, and what the assembler misses."""

    def __init__(self, node):
        super().__init__(
            node=node, newest=None, counts={}, flushed=0, silence=0.0, topics='', missing='',
            clocks='', losses='', images=[], info=Input('info'), transforms=Input('tf'),
            subscriptions=[])
        self.subscriptions = [self.info]

    def tick(self):
        [timer] = self.node.timers
        timer.callback()

    def flush(self):
        self.flushed += 1

    def take_colour(self, message):
        pass

    def take_depth(self, message):
        pass

    def silent_for(self):
        return self.silence

    def missing_for(self, pair):
        assert pair is self.newest
        return self.missing

    def complaint_about_topics(self):
        return self.topics

    def complaint_about_clocks(self):
        return self.clocks

    def complaint_about_losses(self):
        return self.losses

    def subscribe(self, node, name, transport, take, settings):
        assert node is self.node
        self.images.append(Input(name))
        self.images[-1].made_of = transport, take
        return self.images[-1]

    def subscribe_rgbd(self, node, settings, assembler, pairing):
        assert node is self.node and assembler is pairing is self
        self.images.append(Input('rgbd'))
        return self.images[-1]

    def watch(self, node, settings, subscriptions, pairing):
        assert node is self.node and pairing is self
        self.watched = subscriptions
        return self


@pytest.fixture
def world(graph, monkeypatch):
    world = World(graph.node())
    monkeypatch.setattr(image_stream, 'Pairing', lambda *arguments: (
        setattr(world, 'pairs_with', arguments) or world))
    monkeypatch.setattr(image_stream, 'Watchdog', world.watch)
    monkeypatch.setattr(image_stream, 'image_subscription', world.subscribe)
    monkeypatch.setattr(image_stream, 'rgbd_subscription', world.subscribe_rgbd)
    return world


def stream_in(world, **settings):
    return ImageStream(world.node, NodeSettings(**settings), world, world.transforms,
                       'diagnostics', 'on_pair', 'on_colour')


def test_each_image_has_its_topic_transport_and_way(world):
    stream_in(world, image_transport='compressed', depth_transport='compressedDepth')
    assert {each.name: each.made_of for each in world.images} == {
        'rgb/image': ('compressed', world.take_colour),
        'depth/image': ('compressedDepth', world.take_depth)}
    assert world.pairs_with[2:] == ('diagnostics', 'on_pair', 'on_colour')


@pytest.mark.parametrize('is_rgbd, names', [
    (False, ['rgb/image', 'depth/image', 'info']), (True, ['rgbd', 'info'])])
def test_all_subscriptions_are_watched_and_tended(world, is_rgbd, names):
    stream_in(world, subscribe_rgbd=is_rgbd)
    assert [each.name for each in world.watched] == names
    world.tick()
    world.tick()
    assert [each.tended for each in (*world.watched, world.transforms)] == [2] * (len(names) + 1)


def test_they_are_tended_twice_in_the_silence_by_a_clock_that_never_stands_still(world):
    stream_in(world)
    [timer] = world.node.timers
    assert (timer.timer_period_ns, timer.clock.clock_type) == (
        250_000_000, ClockType.STEADY_TIME)


@pytest.mark.parametrize('silence, flushed', [(0.0, 0), (0.5, 0), (0.51, 1), (7.0, 1)])
def test_images_that_wait_for_a_better_partner_are_paired_in_the_silence(world, silence, flushed):
    stream_in(world)
    world.silence = silence
    world.tick()
    assert world.flushed == flushed


def test_the_first_complaint_is_that_of_topics_then_of_what_a_pair_needs(world):
    stream = stream_in(world)
    assert stream.complaint() == ''
    world.losses = 'losses'
    assert stream.complaint() == 'losses'
    world.clocks = 'clocks'
    assert stream.complaint() == 'clocks'
    world.missing = 'no calibration'
    assert stream.complaint() == 'clocks'  # nothing is missing before there is a pair
    world.newest = 'a pair'
    assert stream.complaint() == 'no calibration'
    world.topics = 'topics'
    assert stream.complaint() == 'topics'


def test_pairs_and_counts_are_those_of_the_pairing(world):
    stream = stream_in(world)
    world.newest, world.counts = 'pair', {'lost': 3}
    assert (stream.newest, stream.counts) == ('pair', {'lost': 3})


def test_what_is_the_assemblers_stays_open(world):
    stream_in(world).close()
    assert [each.is_closed for each in (*world.images, world.info)] == [True, True, False]
    assert list(world.node.timers) == []
