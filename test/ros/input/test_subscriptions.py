# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Subscriptions that change their QoS: their rules on a node, then the node in its process."""

import dataclasses
import time

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.input.subscriptions import (
    AdaptiveSubscription, camera_info_subscription, image_subscription, image_topics)
from aick_ros.settings.node import NodeSettings

START, PERIOD = 10 ** 18, 33_333_333
RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
LATCHED, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE


def take(subscription):
    """Take a message as an executor does; None: there is none."""
    with subscription.handle:
        taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    return None if taken is None else taken[0]


class Change:
    """
    A subscription that changes from best effort to reliable.

    :ivar old: the subscription before the change; it still receives.
    :ivar new: the subscription after the change.
    :ivar taken: numbers of the images taken so far.
    """

    def __init__(self, node, neighbours, stamped, **options):
        self.node, self.neighbours = node, neighbours
        self.taken, self._stamped, self.new = [], stamped, None
        self.subscription = AdaptiveSubscription(
            node, Image, 'rgb/image', self._take, depth=10, **options)
        [self.old] = node.subscriptions
        self._driver = neighbours.offer('/rgb/image', durability=LATCHED)

    def adapt(self):
        self.subscription.adapt()
        *_, self.new = self.node.subscriptions

    def publish(self, *numbers, by=None):
        """Publish images; those that match have them in their queues."""
        self.neighbours.send(by or self._driver, *(
            self._stamped(START + number * PERIOD) for number in numbers))

    def reach_old(self, *numbers):
        """Put images into the queue of the old subscription alone, which is best effort."""
        passing = self.neighbours.offer('/rgb/image', BEST_EFFORT)
        self.publish(*numbers, by=passing)
        self.neighbours.withdraw(passing)

    def reach_new(self, *numbers):
        """Put images into the queue of the new subscription; that of the old one is empty."""
        assert self.old not in self.node.subscriptions or take(self.old) is None
        self.publish(*numbers)
        while self.old in self.node.subscriptions and take(self.old) is not None:
            pass

    def execute(self, subscription):
        """Take one message as the executor does, and return whether there is one."""
        message = take(subscription)
        if message is not None:
            subscription.callback(message)
        return message is not None

    def spin(self):
        """Take one message of each subscription in turn, until none is left."""
        while any([self.execute(subscription) for subscription in list(self.node.subscriptions)]):
            pass

    def _take(self, message):
        self.taken.append((to_stamp(message.header.stamp) - START) // PERIOD)


@pytest.fixture
def change(node, neighbours, stamped):
    return Change(node, neighbours, stamped)


@pytest.mark.parametrize('latched, reliability, requested', [
    (False, 'auto', BEST_EFFORT), (False, 'best_effort', BEST_EFFORT),
    (False, 'reliable', RELIABLE), (True, 'auto', RELIABLE), (True, 'best_effort', RELIABLE)])
def test_before_there_is_a_publisher_what_is_sent_once_is_requested_reliably(
        node, latched, reliability, requested):
    subscription = AdaptiveSubscription(node, Image, 'rgb/camera_info', print, depth=10,
                                        reliability=reliability, latched=latched)
    [made] = node.subscriptions
    assert made.qos_profile.reliability == requested
    assert subscription.qos_profile.durability == VOLATILE


def test_images_of_the_old_queue_come_before_those_of_the_new_one(change):
    change.publish(0, 1, 2, 3)
    change.adapt()
    change.publish(4, 5)
    change.execute(change.new)
    change.spin()
    assert change.taken == [0, 1, 2, 3, 4, 5]
    assert list(change.node.subscriptions) == [change.new]


def test_closed_it_takes_nothing_more(change):
    change.publish(0, 1)
    change.adapt()
    change.subscription.close()
    assert list(change.node.subscriptions) == []
    assert change.taken == []


@pytest.mark.parametrize('taken_first', range(7))
def test_an_image_of_both_queues_is_taken_once(change, taken_first):
    """However many of its messages the old subscription brings before the new one."""
    change.adapt()
    change.reach_new(3, 4, 5, 6, 7)
    change.reach_old(0, 1, 2, 3, 4, 5)
    for _ in range(taken_first):
        assert change.execute(change.old)
    change.spin()
    assert change.taken == list(range(8))


def test_an_image_lost_by_the_old_subscription_is_brought_by_the_new_one(change):
    change.adapt()
    change.reach_new(3, 4, 5, 6)
    change.reach_old(0, 1, 2, 4, 5)
    change.execute(change.new)
    change.spin()
    assert change.taken == list(range(7))


def test_an_image_older_than_those_taken_is_not_taken(change):
    """Downstream it would count as rejected: its stamp goes back."""
    change.adapt()
    change.reach_old(0, 1, 2, 4)
    for _ in range(4):
        assert change.execute(change.old)
    change.reach_new(3, 4, 5)
    change.spin()
    assert change.taken == [0, 1, 2, 4, 5]


def test_a_driver_that_repeats_images_after_the_change_is_not_hidden(change):
    change.adapt()
    change.reach_new(1, 2, 2, 3)
    change.spin()
    assert change.taken == [1, 2, 2, 3]


def test_stamps_that_stand_still_after_the_change_are_not_hidden(change):
    """So that their rejection can be reported downstream."""
    change.publish(0)
    change.spin()
    change.adapt()
    for _ in range(30):
        change.reach_new(0)
        change.spin()
    assert len(change.taken) == 1 + 30 - 20  # at most twice the depth of the queue is dropped


def test_a_recording_that_starts_again_at_the_change_is_taken(change):
    back = -2 * RESTART_AFTER // PERIOD
    change.adapt()
    change.reach_new(back, back + 1)
    change.reach_old(0, 1)
    change.execute(change.new)
    change.spin()
    assert change.taken == [0, 1, back, back + 1]


def test_the_old_subscription_goes_on_until_the_new_one_receives(change):
    change.adapt()
    change.reach_old(0, 1)
    change.spin()
    change.adapt()
    change.reach_old(2)
    change.spin()
    assert change.taken == [0, 1, 2]


def test_a_second_change_before_the_first_image_loses_nothing(change):
    change.publish(0)
    change.adapt()
    second = change.new
    change.publish(1)
    best_effort = change.neighbours.offer('/rgb/image', BEST_EFFORT)
    change.adapt()
    assert list(change.node.subscriptions) == [second, change.new]
    change.publish(2)
    change.publish(3, by=best_effort)  # does not match the second one
    change.spin()
    assert change.taken == [0, 1, 2, 3]
    assert list(change.node.subscriptions) == [change.new]


def test_calibrations_are_taken_again(node, neighbours, stamped):
    """Many have no stamp, and the one that was published before must not be lost."""
    change = Change(node, neighbours, stamped, latched=True)
    change.publish(0)
    change.adapt()
    neighbours.wait_until(lambda: change.execute(change.new), 'the one from before')
    assert change.taken == [0, 0]
    change.publish(0)
    change.spin()
    assert change.taken == [0, 0, 0]


@pytest.mark.parametrize('wanted, offered, expected', [
    ('auto', [RELIABLE, RELIABLE], RELIABLE),
    ('auto', [RELIABLE, BEST_EFFORT], BEST_EFFORT),
    ('auto', [], BEST_EFFORT),
    ('reliable', [BEST_EFFORT], RELIABLE),
    ('best_effort', [RELIABLE], BEST_EFFORT),
], ids=str)
def test_the_reliability_follows_the_publishers_or_the_parameter(node, neighbours, wanted,
                                                                 offered, expected):
    subscription = AdaptiveSubscription(node, Image, 'rgb/image', None, 10, wanted)
    for reliability in offered:
        neighbours.offer('/rgb/image', reliability)
    subscription.adapt()
    assert subscription.qos_profile.reliability == expected


@pytest.mark.parametrize('offered, expected', [
    ([LATCHED], LATCHED), ([VOLATILE], VOLATILE), ([LATCHED, VOLATILE], VOLATILE)], ids=str)
def test_earlier_messages_are_requested_where_all_publishers_keep_them(node, neighbours,
                                                                       offered, expected):
    subscription = AdaptiveSubscription(node, Image, 'info', None, 10, latched=True)
    for durability in offered:
        neighbours.offer('/info', durability=durability)
    subscription.adapt()
    assert subscription.qos_profile.durability == expected


@pytest.mark.parametrize('published, expected', [
    ('/rgb/image/compressed', ('/rgb/image/compressed', 'compressed')),
    ('/rgb/image', ('', '')), ('/elsewhere', ('', ''))])
def test_another_transport_of_the_topic_is_found(node, neighbours, published, expected):
    subscription = AdaptiveSubscription(node, Image, 'rgb/image', None, 10)
    neighbours.offer(published)
    assert subscription.published_instead() == expected


@pytest.mark.parametrize('published, expected', [
    ('/rgb/image', ('/rgb/image', 'raw')),
    ('/rgb/image/compressedDepth', ('/rgb/image/compressedDepth', 'compressedDepth')),
    ('/rgb/image/compressed', ('', ''))])
def test_of_a_compressed_topic_the_others_are_found_beside_it(
        node, neighbours, published, expected):
    subscription = AdaptiveSubscription(
        node, CompressedImage, 'rgb/image', None, 10, suffix='/compressed')
    assert subscription.topic_name == '/rgb/image/compressed'
    neighbours.offer(published, kind=Image if published == '/rgb/image' else CompressedImage)
    assert subscription.published_instead() == expected


def test_the_publishers_are_those_of_the_topic_with_its_suffix(node, neighbours):
    subscription = AdaptiveSubscription(
        node, CompressedImage, 'rgb/image', None, 10, suffix='/compressed')
    neighbours.offer('/rgb/image', name='other')
    neighbours.offer('/rgb/image/compressed', name='driver', kind=CompressedImage)
    assert [publisher.node_name for publisher in subscription.publishers()] == ['driver']


def test_a_changed_subscription_is_the_same_but_for_its_qos(change):
    change.adapt()
    for made in (change.old, change.new):
        assert (made.msg_type, made.topic_name) == (Image, '/rgb/image')
        assert made.qos_profile.depth == 10
        # ROS would log each mismatch, which is resolved or explained here
        assert not made.event_handlers
    assert (change.old.qos_profile.reliability, change.new.qos_profile.reliability) == (
        BEST_EFFORT, RELIABLE)
    change.adapt()
    # there is nothing to change
    assert list(change.node.subscriptions) == [change.old, change.new]


def test_either_subscription_ends_the_silence(change, steady):
    change.subscription.received_at = steady.now
    change.adapt()
    for subscription, reach in ((change.old, change.reach_old), (change.new, change.reach_new)):
        steady.now += 1.0
        reach(0)
        assert change.execute(subscription)
        assert change.subscription.received_at == steady.now


def test_before_the_first_message_the_silence_counts_from_the_start(node, steady):
    subscription = AdaptiveSubscription(node, Image, 'rgb/image', None, 10)
    assert subscription.received_at == steady.now
    assert not subscription.may_be_silent


@pytest.mark.parametrize('back, taken', [
    (0, 1), (RESTART_AFTER, 1), (RESTART_AFTER + 1, 2)])
def test_a_recording_starts_again_only_where_stamps_go_back_by_more_than_a_second(
        node, neighbours, stamped, back, taken):
    received = []
    subscription = AdaptiveSubscription(node, Image, 'rgb/image', received.append, 10)
    [old] = node.subscriptions
    old.callback(stamped(START))
    neighbours.offer('/rgb/image')
    subscription.adapt()
    *_, new = node.subscriptions
    new.callback(stamped(START - back))
    assert len(received) == taken


@pytest.mark.parametrize('settings, names', [
    ({}, ('rgb/image', 'depth/image')), ({'rgbd_cameras': 1}, ('rgb/image', 'depth/image')),
    ({'subscribe_rgbd': True, 'rgbd_cameras': 0}, ('rgbd_images',) * 2),
    ({'subscribe_rgbd': True}, ('rgbd_image',) * 2),
    ({'subscribe_rgbd': True, 'rgbd_cameras': 2}, ('rgbd_image0',) * 2)])
def test_the_topics_of_images_are_named_as_rgbd_odometry_does(settings, names):
    assert image_topics(NodeSettings(**settings)) == names


@pytest.mark.parametrize('transport, kind, topic', [
    ('raw', Image, '/rgb/image'), ('compressed', CompressedImage, '/rgb/image/compressed'),
    ('compressedDepth', CompressedImage, '/rgb/image/compressedDepth')])
def test_images_are_subscribed_to_by_their_transport_and_as_the_parameters_say(
        node, neighbours, stamped, transport, kind, topic):
    taken = []
    subscription = image_subscription(
        node, 'rgb/image', transport, taken.append,
        NodeSettings(topic_queue_size=7, qos_reliability='reliable'))
    [made] = node.subscriptions
    assert (made.msg_type, made.topic_name, subscription.name) == (kind, topic, 'rgb/image')
    assert (made.qos_profile.depth, made.qos_profile.reliability) == (7, RELIABLE)
    neighbours.offer(topic, durability=LATCHED, kind=kind)
    subscription.adapt()
    assert list(node.subscriptions) == [made]  # images of the past are not requested
    made.callback(kind(header=stamped(START).header))
    assert len(taken) == 1


def test_a_calibration_is_subscribed_to_so_that_one_sent_once_arrives(node, neighbours):
    taken = []
    subscription = camera_info_subscription(node, 'rgb/camera_info', taken.append)
    neighbours.offer('/rgb/camera_info', durability=LATCHED, kind=CameraInfo)
    subscription.adapt()
    *_, made = node.subscriptions
    assert (made.msg_type, made.topic_name, subscription.name) == (
        CameraInfo, '/rgb/camera_info', 'rgb/camera_info')
    assert (made.qos_profile.reliability, made.qos_profile.durability) == (RELIABLE, LATCHED)
    assert made.qos_profile.depth == 10
    made.callback(CameraInfo())
    made.callback(CameraInfo())
    assert len(taken) == 2


# Over DDS.

@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:2])


def subscriptions(rig, topic):
    return rig.node.get_subscriptions_info_by_topic(f'/{topic}')


@pytest.mark.parametrize('reliability', [RELIABLE, BEST_EFFORT], ids=lambda r: r.name)
def test_subscriptions_request_what_is_offered(rig, start_node, reliability):
    """Of a camera that starts after the node, and of another one that offers the contrary."""
    rig.withdraw(rig.colour)
    start_node(wait=False, qos_reliability='auto', topic_queue_size=10)
    rig.wait_until(lambda: subscriptions(rig, 'rgb/image'), 'the node')
    other = {RELIABLE: BEST_EFFORT, BEST_EFFORT: RELIABLE}[reliability]
    for offered in (reliability, other):
        rig.colour = rig.node.create_publisher(
            Image, 'rgb/image', QoSProfile(depth=10, reliability=offered))
        rig.wait_until(lambda: [s.qos_profile.reliability for s in subscriptions(
            rig, 'rgb/image')][-1:] == [offered], f'a subscription {offered.name}')
        rig.withdraw(rig.colour)


def test_no_frame_is_missed_or_taken_twice_when_the_subscription_changes(rig, start_node, frames):
    """A second, best-effort publisher starts and ends while the first one goes on."""
    start_node(qos_reliability='auto')
    rig.send_camera_info(frames[0].camera)
    sent = []

    def send_until(reliability):
        deadline = time.monotonic() + rig.patience
        while [s.qos_profile.reliability
               for s in subscriptions(rig, 'rgb/image')] != [reliability]:
            assert time.monotonic() < deadline, f'the subscription never became {reliability.name}'
            send()

    def send():
        # no more on the way than the publisher's segment of shared memory holds
        rig.wait_until(lambda: len(sent) - len(rig.odom) < 8, lambda: (
            f'odometry of {sent}, there is {rig.stamps()}'))
        sent.append(START + len(sent) * PERIOD)
        rig.send(dataclasses.replace(frames[len(sent) % 2], stamp=sent[-1], depth_stamp=None))

    send_until(RELIABLE)
    send()
    second = rig.node.create_publisher(Image, 'rgb/image', QoSProfile(
        depth=1, reliability=BEST_EFFORT))
    send_until(BEST_EFFORT)
    rig.withdraw(second)
    send_until(RELIABLE)
    send()
    rig.answer(sent[-1])
    assert rig.stamps() == sent
    assert rig.values().get('images rejected', '0') == '0'
