# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Subscriptions that change their QoS: their rules without DDS, then the node over DDS."""

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


class Change:
    """
    A subscription that has just changed from best effort to reliable.

    :ivar old: the subscription before the change; it still receives.
    :ivar new: the subscription after the change.
    :ivar taken: numbers of the images taken so far.
    """

    def __init__(self, node, stamped, latched=False, **options):
        self.node, self.taken, self._stamped = node, [], stamped
        self.subscription = AdaptiveSubscription(
            node, Image, 'rgb/image', self._take, depth=10, latched=latched, **options)
        self.old, self.new = node.subscriptions[0], None
        node.publish('/rgb/image', durability=DurabilityPolicy.TRANSIENT_LOCAL)

    def adapt(self):
        self.subscription.adapt()
        self.new = self.node.subscriptions[-1]

    def arrive(self, subscription, *numbers):
        """Put images into the queue of a subscription."""
        subscription.queue += [self._stamped(START + number * PERIOD) for number in numbers]

    def spin(self):
        """Take one message of each subscription in turn, until none is left."""
        while any(subscription.queue for subscription in self.node.subscriptions):
            for subscription in list(self.node.subscriptions):
                subscription.execute()

    def _take(self, message):
        self.taken.append((to_stamp(message.header.stamp) - START) // PERIOD)


@pytest.fixture
def change(fake_node, stamped):
    return Change(fake_node, stamped)


@pytest.mark.parametrize('latched, reliability, requested', [
    (False, 'auto', BEST_EFFORT), (False, 'best_effort', BEST_EFFORT),
    (False, 'reliable', RELIABLE), (True, 'auto', RELIABLE), (True, 'best_effort', RELIABLE)])
def test_before_there_is_a_publisher_what_is_sent_once_is_requested_reliably(
        fake_node, latched, reliability, requested):
    subscription = AdaptiveSubscription(fake_node, Image, 'rgb/camera_info', print, depth=10,
                                        reliability=reliability, latched=latched)
    assert fake_node.subscriptions[0].qos_profile.reliability == requested
    assert subscription.qos_profile.durability == VOLATILE


def test_images_of_the_old_queue_come_before_those_of_the_new_one(change):
    change.arrive(change.old, 0, 1, 2, 3)
    change.adapt()
    change.arrive(change.new, 4, 5)
    change.new.execute()
    change.spin()
    assert change.taken == [0, 1, 2, 3, 4, 5]
    assert change.node.subscriptions == [change.new]


def test_closed_it_takes_nothing_more(change):
    change.arrive(change.old, 0, 1)
    change.adapt()
    change.subscription.close()
    assert change.node.subscriptions == []
    assert change.taken == []


@pytest.mark.parametrize('taken_first', range(7))
def test_an_image_of_both_queues_is_taken_once(change, taken_first):
    """However many of its messages the old subscription brings before the new one."""
    change.adapt()
    change.arrive(change.old, 0, 1, 2, 3, 4, 5)
    change.arrive(change.new, 3, 4, 5, 6, 7)
    for _ in range(taken_first):
        change.old.execute()
    change.spin()
    assert change.taken == list(range(8))


def test_an_image_lost_by_the_old_subscription_is_brought_by_the_new_one(change):
    change.adapt()
    change.arrive(change.old, 0, 1, 2, 4, 5)
    change.arrive(change.new, 3, 4, 5, 6)
    change.new.execute()
    change.spin()
    assert change.taken == list(range(7))


def test_an_image_older_than_those_taken_is_not_taken(change):
    """Downstream it would count as rejected: its stamp goes back."""
    change.adapt()
    change.arrive(change.old, 0, 1, 2, 4)
    for _ in range(4):
        change.old.execute()
    change.arrive(change.new, 3, 4, 5)
    change.spin()
    assert change.taken == [0, 1, 2, 4, 5]


def test_a_driver_that_repeats_images_after_the_change_is_not_hidden(change):
    change.adapt()
    change.arrive(change.new, 1, 2, 2, 3)
    change.spin()
    assert change.taken == [1, 2, 2, 3]


def test_stamps_that_stand_still_after_the_change_are_not_hidden(change):
    """So that their rejection can be reported downstream."""
    change.arrive(change.old, 0)
    change.spin()
    change.adapt()
    change.arrive(change.new, *30 * [0])
    change.spin()
    assert len(change.taken) == 1 + 30 - 20  # at most twice the depth of the queue is dropped


def test_a_recording_that_starts_again_at_the_change_is_taken(change):
    back = -2 * RESTART_AFTER // PERIOD
    change.arrive(change.old, 0, 1)
    change.adapt()
    change.arrive(change.new, back, back + 1)
    change.new.execute()
    change.spin()
    assert change.taken == [0, 1, back, back + 1]


def test_the_old_subscription_goes_on_until_the_new_one_receives(change):
    change.adapt()
    change.arrive(change.old, 0, 1)
    change.spin()
    change.adapt()
    change.arrive(change.old, 2)
    change.spin()
    assert change.taken == [0, 1, 2]


def test_a_second_change_before_the_first_image_loses_nothing(change):
    change.arrive(change.old, 0, 1)
    change.adapt()
    second = change.new
    change.node.publish('/rgb/image', BEST_EFFORT)
    change.adapt()
    change.arrive(second, 1, 2)
    change.arrive(change.new, 2, 3)
    change.spin()
    assert change.taken == [0, 1, 2, 3]
    assert change.node.subscriptions == [change.new]


def test_calibrations_are_taken_again(fake_node, stamped):
    """Many have no stamp, and the one that was published before must not be lost."""
    change = Change(fake_node, stamped, latched=True)
    change.arrive(change.old, 0)
    change.adapt()
    change.arrive(change.new, 0, 0)
    change.new.execute()
    change.spin()
    assert change.taken == [0, 0, 0]


@pytest.mark.parametrize('wanted, offered, expected', [
    ('auto', [RELIABLE, RELIABLE], RELIABLE),
    ('auto', [RELIABLE, BEST_EFFORT], BEST_EFFORT),
    ('auto', [], BEST_EFFORT),
    ('reliable', [BEST_EFFORT], RELIABLE),
    ('best_effort', [RELIABLE], BEST_EFFORT),
], ids=str)
def test_the_reliability_follows_the_publishers_or_the_parameter(fake_node, wanted, offered,
                                                                 expected):
    subscription = AdaptiveSubscription(fake_node, Image, 'rgb/image', None, 10, wanted)
    for reliability in offered:
        fake_node.publish('/rgb/image', reliability)
    subscription.adapt()
    assert subscription.qos_profile.reliability == expected


@pytest.mark.parametrize('offered, expected', [
    ([LATCHED], LATCHED), ([VOLATILE], VOLATILE), ([LATCHED, VOLATILE], VOLATILE)], ids=str)
def test_earlier_messages_are_requested_where_all_publishers_keep_them(fake_node, offered,
                                                                       expected):
    subscription = AdaptiveSubscription(fake_node, Image, 'info', None, 10, latched=True)
    for durability in offered:
        fake_node.publish('/info', durability=durability)
    subscription.adapt()
    assert subscription.qos_profile.durability == expected


@pytest.mark.parametrize('published, expected', [
    ('/rgb/image/compressed', ('/rgb/image/compressed', 'compressed')),
    ('/rgb/image', ('', '')), ('/elsewhere', ('', ''))])
def test_another_transport_of_the_topic_is_found(fake_node, published, expected):
    subscription = AdaptiveSubscription(fake_node, Image, 'rgb/image', None, 10)
    fake_node.publish(published)
    assert subscription.published_instead() == expected


@pytest.mark.parametrize('published, expected', [
    ('/rgb/image', ('/rgb/image', 'raw')),
    ('/rgb/image/compressedDepth', ('/rgb/image/compressedDepth', 'compressedDepth')),
    ('/rgb/image/compressed', ('', ''))])
def test_of_a_compressed_topic_the_others_are_found_beside_it(fake_node, published, expected):
    subscription = AdaptiveSubscription(
        fake_node, CompressedImage, 'rgb/image', None, 10, suffix='/compressed')
    assert subscription.topic_name == '/rgb/image/compressed'
    fake_node.publish(published)
    assert subscription.published_instead() == expected


def test_the_publishers_are_those_of_the_topic_with_its_suffix(fake_node):
    subscription = AdaptiveSubscription(
        fake_node, CompressedImage, 'rgb/image', None, 10, suffix='/compressed')
    fake_node.publish('/rgb/image', node_name='other')
    fake_node.publish('/rgb/image/compressed', node_name='driver')
    assert [publisher.node_name for publisher in subscription.publishers()] == ['driver']


def test_a_changed_subscription_is_the_same_but_for_its_qos(change):
    change.adapt()
    for made in (change.old, change.new):
        assert (made.msg_type, made.topic_name) == (Image, '/rgb/image')
        assert made.qos_profile.depth == 10
        # ROS would log each mismatch, which is resolved or explained here
        assert not made.events.use_default_callbacks
    assert (change.old.qos_profile.reliability, change.new.qos_profile.reliability) == (
        BEST_EFFORT, RELIABLE)
    change.adapt()
    assert change.node.subscriptions == [change.old, change.new]  # there is nothing to change


def test_either_subscription_ends_the_silence(change, steady):
    change.subscription.received_at = steady.now
    change.adapt()
    for subscription in (change.old, change.new):
        steady.now += 1.0
        change.arrive(subscription, 0)
        subscription.execute()
        assert change.subscription.received_at == steady.now


def test_before_the_first_message_the_silence_counts_from_the_start(fake_node, steady):
    subscription = AdaptiveSubscription(fake_node, Image, 'rgb/image', None, 10)
    assert subscription.received_at == steady.now
    assert not subscription.may_be_silent


@pytest.mark.parametrize('back, taken', [
    (0, 1), (RESTART_AFTER, 1), (RESTART_AFTER + 1, 2)])
def test_a_recording_starts_again_only_where_stamps_go_back_by_more_than_a_second(
        fake_node, stamped, back, taken):
    received = []
    subscription = AdaptiveSubscription(fake_node, Image, 'rgb/image', received.append, 10)
    fake_node.subscriptions[0].callback(stamped(START))
    fake_node.publish('/rgb/image')
    subscription.adapt()
    fake_node.subscriptions[-1].callback(stamped(START - back))
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
        fake_node, stamped, transport, kind, topic):
    taken = []
    subscription = image_subscription(
        fake_node, 'rgb/image', transport, taken.append,
        NodeSettings(topic_queue_size=7, qos_reliability='reliable'))
    [made] = fake_node.subscriptions
    assert (made.msg_type, made.topic_name, subscription.name) == (kind, topic, 'rgb/image')
    assert (made.qos_profile.depth, made.qos_profile.reliability) == (7, RELIABLE)
    fake_node.publish(topic, durability=LATCHED)
    subscription.adapt()
    assert fake_node.subscriptions == [made]  # images of the past are not requested
    made.callback(stamped(START))
    assert len(taken) == 1


def test_a_calibration_is_subscribed_to_so_that_one_sent_once_arrives(fake_node, stamped):
    taken = []
    subscription = camera_info_subscription(fake_node, 'rgb/camera_info', taken.append)
    fake_node.publish('/rgb/camera_info', durability=LATCHED)
    subscription.adapt()
    made = fake_node.subscriptions[-1]
    assert (made.msg_type, made.topic_name, subscription.name) == (
        CameraInfo, '/rgb/camera_info', 'rgb/camera_info')
    assert (made.qos_profile.reliability, made.qos_profile.durability) == (RELIABLE, LATCHED)
    assert made.qos_profile.depth == 10
    made.callback(stamped(0))
    made.callback(stamped(0))
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
    rig.node.destroy_publisher(rig.colour)
    start_node(wait=False, qos_reliability='auto', topic_queue_size=10)
    rig.wait_until(lambda: subscriptions(rig, 'rgb/image'), 'the node')
    other = {RELIABLE: BEST_EFFORT, BEST_EFFORT: RELIABLE}[reliability]
    for offered in (reliability, other):
        rig.colour = rig.node.create_publisher(
            Image, 'rgb/image', QoSProfile(depth=10, reliability=offered))
        rig.wait_until(lambda: [s.qos_profile.reliability for s in subscriptions(
            rig, 'rgb/image')][-1:] == [offered], f'a subscription {offered.name}')
        rig.node.destroy_publisher(rig.colour)


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
    rig.node.destroy_publisher(second)
    send_until(RELIABLE)
    send()
    rig.answer(sent[-1])
    assert rig.stamps() == sent
    assert rig.values().get('images rejected', '0') == '0'
