# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairing of images as they are received: which are rejected, counted and passed on."""

import math

import numpy as np
import pytest
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rclpy.time import Time

from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.pairing import Pairing, _max_interval
from aick_ros.settings.node import NodeSettings

START, PERIOD = 10 ** 18, 33_333_333


@pytest.fixture
def make(node, steady):
    """Return a function that makes a pairing; what it passes on and reports are attributes."""
    def make(**settings):
        pairs, report, colour = [], Diagnostics(node), []
        pairing = Pairing(node, NodeSettings(**settings), report, pairs.append, colour.append)
        pairing.pairs, pairing.report, pairing.colour = pairs, report, colour
        return pairing
    return make


def counted(pairing):
    """Return what was counted in the report of a pairing."""
    return {count: total for count, total in pairing.report.snapshot().totals.items() if total}


def test_before_the_first_image_there_is_nothing(make, steady):
    pairing = make()
    assert (pairing.newest, pairing.ahead, pairing.rejection) == (None, 0, '')
    assert pairing.paired_at == steady.now
    assert pairing.rejected_at == -math.inf
    assert pairing.recent_counts(5.0) == {'rgb/image': 0, 'depth/image': 0}


def test_a_pair_is_passed_on(make, stamped, steady):
    pairing, colour, depth = make(), stamped(START), stamped(START)
    assert pairing.newest is None
    pairing.take_colour(colour)
    steady.now += 2.0
    pairing.take_depth(depth)
    assert pairing.pairs == [(START, colour, START, depth)]
    assert pairing.newest is pairing.pairs[-1]
    assert pairing.paired_at == steady.now
    assert counted(pairing) == {Count.RECEIVED: 1}
    assert pairing.rejection == ''


@pytest.mark.parametrize('name', ['rgb/image', 'depth/image'])
@pytest.mark.parametrize('stamp, reason', [
    (START, f'its stamp of {START} ns repeats or goes back; does the driver publish twice, or '
     'the network change the order?'), (START - PERIOD, 'repeats or goes back'),
    (0, 'must stamp its images'), (START + 3600 * 10 ** 9, 'is far ahead of those before')])
def test_an_image_that_is_rejected_is_counted_and_named(make, stamped, steady, log, name,
                                                        stamp, reason):
    pairing = make()
    take = {'rgb/image': pairing.take_colour, 'depth/image': pairing.take_depth}[name]
    take(stamped(START))
    steady.now += 1.0
    take(stamped(stamp))
    assert pairing.rejection.startswith(f'image on {name} rejected: ')
    assert reason in pairing.rejection
    assert log.warnings == [pairing.rejection]
    assert pairing.rejected_at == steady.now
    assert counted(pairing) == {Count.IMAGES_REJECTED: 1}


def test_rejections_are_not_logged_for_each_image(make, stamped, log):
    pairing = make()
    for _ in range(4):
        pairing.take_colour(stamped(START))
    assert counted(pairing) == {Count.IMAGES_REJECTED: 3}
    assert len(log.warnings) == 1
    assert min(log.throttles) >= 1.0


def test_after_a_late_image_those_in_order_are_accepted(make, stamped):
    pairing = make()
    for stamp in (START, START + PERIOD, START, START + 2 * PERIOD):
        pairing.take_colour(stamped(stamp))
        pairing.take_depth(stamped(stamp))
    assert [pair.colour_stamp for pair in pairing.pairs] == [
        START, START + PERIOD, START + 2 * PERIOD]
    assert counted(pairing) == {Count.RECEIVED: 3, Count.IMAGES_REJECTED: 2}


def test_a_stray_stamp_does_not_pair(make, stamped):
    pairing, stray = make(), START + 3600 * 10 ** 9
    pairing.take_colour(stamped(START))
    pairing.take_colour(stamped(stray))
    pairing.take_depth(stamped(START))
    assert [pair.colour_stamp for pair in pairing.pairs] == [START]


def set_clock(node, now):
    node.set_parameters([Parameter('use_sim_time', value=True)])
    node.get_clock().set_ros_time_override(Time(nanoseconds=now, clock_type=ClockType.ROS_TIME))


def test_an_image_is_as_far_ahead_as_it_was_when_it_came(make, stamped, node):
    """A stray one does not count, nor any as long as nobody publishes /clock."""
    pairing, stray = make(), START + 3600 * 10 ** 9
    set_clock(node, 0)
    pairing.take_colour(stamped(START))
    assert pairing.ahead == 0
    set_clock(node, START)
    pairing.take_colour(stamped(START + PERIOD))
    pairing.take_colour(stamped(stray))
    set_clock(node, START - 10 ** 10)
    assert pairing.ahead == PERIOD
    pairing.take_pair(pair_of(stamped, START + 2 * PERIOD))
    assert pairing.ahead == 2 * PERIOD + 10 ** 10


def test_stamps_of_colour_images_are_passed_on_whether_or_not_they_find_a_partner(
        make, stamped):
    pairing = make()
    for stamp in (START, START + PERIOD, START):  # the last one is late
        pairing.take_colour(stamped(stamp))
    pairing.take_depth(stamped(START + 9 * PERIOD))
    pairing.take_pair(pair_of(stamped, START + 10 * PERIOD))
    assert pairing.colour == [START, START + PERIOD, START + 10 * PERIOD]


def test_flush_pairs_what_waits_for_a_nearer_image(make, stamped):
    pairing = make()
    pairing.take_colour(stamped(START))
    pairing.take_depth(stamped(START + 5_000_000))
    assert pairing.pairs == []
    pairing.flush()
    assert [(pair.colour_stamp, pair.depth_stamp) for pair in pairing.pairs] == [
        (START, START + 5_000_000)]


@pytest.mark.parametrize('settings, error, pairs', [
    ({'approx_sync': False}, 1, 0), ({'approx_sync': False}, 0, 1),
    ({'approx_sync_max_interval': 0.01}, 9_000_000, 1),
    ({'approx_sync_max_interval': 0.01}, 11_000_000, 0)])
def test_the_interval_of_a_pair_is_that_of_the_parameters(make, stamped, settings, error, pairs):
    pairing = make(**settings)
    pairing.take_colour(stamped(START))
    pairing.take_depth(stamped(START + error))
    pairing.flush()
    assert len(pairing.pairs) == pairs


def test_images_without_a_partner_are_counted(make, stamped):
    pairing = make(sync_queue_size=3)
    for i in range(10):
        pairing.take_colour(stamped(START + i * PERIOD))
    assert pairing.counts[Count.COLOUR_UNPAIRED] == 7
    assert pairing.counts[Count.DEPTH_UNPAIRED] == 0


def test_images_that_do_not_arrive_are_counted_for_each_topic(make, stamped, steady):
    pairing = make()
    lost = np.random.default_rng(0).random(300) < 0.3
    for i in range(300):
        steady.now += PERIOD / 1e9
        if not lost[i]:
            pairing.take_colour(stamped(START + i * PERIOD))
        pairing.take_depth(stamped(START + i * PERIOD))
    assert pairing.counts[Count.COLOUR_MISSING] == pytest.approx(lost.sum(), abs=3)
    assert pairing.counts[Count.DEPTH_MISSING] == 0
    assert pairing.missing_shares['rgb/image'] == pytest.approx(0.3, abs=0.1)
    assert pairing.missing_shares['depth/image'] == 0


def test_depth_of_another_frame_is_warned_of_once(make, stamped, log):
    pairing = make()
    for stamp in (START, START + PERIOD):
        pairing.take_colour(stamped(stamp))
        pairing.take_depth(stamped(stamp, 'infrared'))
    assert len(pairing.pairs) == 2
    assert log.warnings == [
        "depth images are of frame 'infrared', colour images of 'camera': if the driver does not "
        'register depth to colour, set register_depth to true']
    assert log.throttles == []  # for ever


@pytest.mark.parametrize('registers, frame_id', [(False, 'camera'), (True, 'infrared')])
def test_depth_that_is_or_will_be_registered_is_not_warned_of(make, stamped, log, registers,
                                                              frame_id):
    pairing = make(register_depth=registers)
    pairing.take_colour(stamped(START))
    pairing.take_depth(stamped(START, frame_id))
    assert len(pairing.pairs) == 1
    assert log.warnings == []


@pytest.mark.parametrize('nanosec', [10 ** 9, 2 ** 32 - 1])
def test_nanoseconds_beyond_a_second_are_rejected(make, stamped, nanosec):
    pairing, image = make(), stamped(START)
    image.header.stamp.nanosec = nanosec
    pairing.take_colour(image)
    assert pairing.rejection == (
        f'image on rgb/image rejected: its stamp has {nanosec} ns beside the seconds, at most '
        '999999999 are a time; the driver must stamp its images')
    pairing.take_colour(stamped(START))
    pairing.take_depth(stamped(START))
    assert len(pairing.pairs) == 1


def test_the_last_nanosecond_of_a_second_is_a_time(make, stamped):
    pairing = make()
    pairing.take_colour(stamped(START - 1))
    assert pairing.rejection == ''


def pair_of(stamped, stamp, depth_stamp=None):
    depth_stamp = stamp if depth_stamp is None else depth_stamp
    return Pair(stamp, stamped(stamp), depth_stamp, stamped(depth_stamp, 'depth'))


def test_images_that_came_together_are_one_pair_whatever_their_stamps(make, stamped):
    pairing = make(subscribe_rgbd=True, approx_sync=False)
    pairs = [pair_of(stamped, START, START + 4_000_000),
             pair_of(stamped, START + PERIOD, START + PERIOD + 4_000_000)]
    for pair in pairs:
        pairing.take_pair(pair)
    assert pairing.pairs == pairs
    assert pairing.newest is pairs[-1]
    assert counted(pairing) == {Count.RECEIVED: 2}
    assert pairing.recent_counts(1.0) == {'rgbd_image': 4}


@pytest.mark.parametrize('colour, depth', [(0, START + PERIOD), (START + PERIOD, 0)])
def test_of_images_that_came_together_both_must_have_a_stamp(make, stamped, colour, depth):
    pairing = make(subscribe_rgbd=True)
    pairing.take_pair(pair_of(stamped, START))
    pairing.take_pair(pair_of(stamped, colour, depth))
    assert len(pairing.pairs) == 1
    assert counted(pairing) == {Count.RECEIVED: 1, Count.IMAGES_REJECTED: 1}
    assert pairing.rejection.startswith('image on rgbd_image rejected: ')


def test_images_that_came_together_twice_are_rejected_once(make, stamped):
    pairing = make(subscribe_rgbd=True)
    pairing.take_pair(pair_of(stamped, START))
    pairing.take_pair(pair_of(stamped, START))
    assert len(pairing.pairs) == 1
    assert pairing.rejection.startswith(
        f'image on rgbd_image rejected: its stamp of {START} ns repeats')


def test_images_of_the_last_seconds_are_counted(make, stamped, steady):
    pairing = make()
    for i in range(10):
        pairing.take_colour(stamped(START + i * PERIOD))
        steady.now += 1.0
    pairing.take_depth(stamped(0))  # is rejected
    assert pairing.recent_counts(4.5) == {'rgb/image': 4, 'depth/image': 0}
    assert pairing.recent_counts(4.0) == {'rgb/image': 4, 'depth/image': 0}
    assert pairing.recent_counts(3.9) == {'rgb/image': 3, 'depth/image': 0}


@pytest.mark.parametrize('approx, given, expected', [
    (False, 0.02, 0.0), (True, 0.02, 0.02), (True, 0.0, math.inf)])
def test_no_largest_interval_is_any_and_exact_pairs_have_none(approx, given, expected):
    settings = NodeSettings(approx_sync=approx, approx_sync_max_interval=given)
    assert _max_interval(settings) == expected
