# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Complaints of the watchdog about silent topics, losses and clocks."""

import math

import pytest
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rclpy.qos import ReliabilityPolicy
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.subscriptions import AdaptiveSubscription
from aick_ros.ros.input.watchdog import Watchdog
from aick_ros.ros.process.resources import profiles_variable
from aick_ros.settings.node import NodeSettings

NAMES = ('rgb/image', 'depth/image', 'rgb/camera_info')


class Seen(Pairing):
    """Pairs of images, whose losses and times the test sets: many images make few losses."""

    missing_shares = {'rgb/image': 0.0, 'depth/image': 0.0}

    def recent_counts(self, seconds):
        return {'rgb/image': 150, 'depth/image': 150}


def set_clock(node, now):
    """Have the clock of a node be at a time [ns]; 0 as long as nobody publishes /clock."""
    node.set_parameters([Parameter('use_sim_time', value=True)])
    node.get_clock().set_ros_time_override(Time(nanoseconds=now, clock_type=ClockType.ROS_TIME))


class Watched:
    """A watchdog, its subscriptions by name, and pairs whose losses the test sets."""

    def __init__(self, node, steady, reliability='auto', names=NAMES, **settings):
        self._node, self._steady = node, steady
        self.subscriptions = {name: AdaptiveSubscription(
            node, CameraInfo if name == 'rgb/camera_info' else Image, name, lambda message: None,
            10, reliability) for name in names}
        settings = NodeSettings(**settings)
        self.pairing = Seen(node, settings, Diagnostics(node), lambda pair: None,
                            lambda stamp: None)
        self.dog = Watchdog(node, settings, list(self.subscriptions.values()), self.pairing)

    def wait(self, seconds, receiving=()):
        """Let time pass, at whose end some topics receive a message."""
        self._steady.now += seconds
        for name in receiving:
            self.subscriptions[name].received_at = self._steady.now

    @property
    def complaint(self):
        return self.dog.complaint_about_topics()


@pytest.fixture
def watched(node, steady):
    return Watched(node, steady)


def test_silence_is_tolerated_for_five_seconds(watched):
    watched.wait(4.9)
    assert watched.complaint == ''
    assert watched.dog.silent_for() == pytest.approx(4.9)
    watched.wait(0.2)
    assert watched.complaint != ''


def test_at_exactly_five_seconds_it_is_still_tolerated(watched):
    watched.wait(5.0)
    assert watched.complaint == ''


def test_several_reasons_are_given_together(watched, neighbours, steady):
    neighbours.offer('/rgb/image', name='driver')
    watched.wait(6.0, ['rgb/camera_info'])
    watched.pairing.rejected_at, watched.pairing.rejection = steady.now, 'image rejected: why'
    silent, unpublished, rejected = watched.complaint.split('; ', 1)[0], *[
        sentence for sentence in watched.complaint.split('; ')
        if sentence.startswith(('nobody publishes /depth/image:', 'image rejected'))]
    assert silent == ('nothing on /rgb/image for 5 s, though driver is there: it sends no images, '
                      'or none arrives')
    assert unpublished.endswith('start the camera, or remap depth/image to its topics')
    assert rejected == 'image rejected: why'


def test_where_a_topic_is_silent_pairs_are_not_asked_for(watched, neighbours):
    neighbours.offer('/depth/image')
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert 'synchronize' not in watched.complaint


def test_images_that_do_pair_need_nothing(watched, steady):
    watched.wait(6.0, NAMES)
    watched.pairing.paired_at = steady.now - 5.0
    assert watched.complaint == ''
    watched.pairing.paired_at = steady.now - 5.1
    assert watched.complaint == (
        'colour and depth images come, but for 5 s no two of them have stamps within '
        'approx_sync_max_interval = 0.02 s: synchronize the camera, or raise it')


def test_the_cure_of_losses_is_a_profile_of_the_driver(watched):
    watched.pairing.missing_shares = {'rgb/image': 0.5, 'depth/image': 0.0}
    assert watched.dog.complaint_about_losses() == (
        '50% of the images on /rgb/image do not arrive: if Fast DDS loses them, start the driver '
        'with config/fastdds.xml of this package, on another host with '
        f"config/fastdds_wireless.xml ({profiles_variable()}; on this node's side it changes "
        'nothing)')


def test_the_images_of_the_last_five_seconds_are_counted(watched):
    asked = []
    watched.pairing.recent_counts = lambda seconds: (
        asked.append(seconds) or {'rgb/image': 9, 'depth/image': 10})
    watched.wait(6.0, NAMES)
    assert watched.complaint.startswith('in 5 s only few images arrive (9 on /rgb/image), and no '
                                        'two of them are a pair: if Fast DDS loses them')
    assert set(asked) == {5.0}


def test_the_clocks_are_explained_in_sentences(watched, node):
    set_clock(node, 0)
    assert watched.dog.complaint_about_clocks() == (
        'use_sim_time is true, and nobody publishes /clock: play the bag with --clock, or set '
        'use_sim_time to false')
    set_clock(node, 10 ** 18)
    watched.pairing.ahead = 10 ** 9
    assert watched.dog.complaint_about_clocks() == ''
    watched.pairing.ahead += 5 * 10 ** 8
    assert watched.dog.complaint_about_clocks() == (
        "images are stamped 1.5 s ahead of this node's clock: let /clock and the images come from "
        'one bag or simulator')
    node.set_parameters([Parameter('use_sim_time', value=False)])
    assert watched.dog.complaint_about_clocks() == (
        "images are stamped 1.5 s ahead of this node's clock: let the clocks of both computers be "
        'synchronized (chrony), or set use_sim_time where a bag is played')


def test_a_clock_that_is_set_back_is_not_blamed_on_the_images_before(watched, node, stamped):
    """As by a bag that loops: an image counts by the clock when it came."""
    set_clock(node, 10 ** 18)
    watched.pairing.take_colour(stamped(10 ** 18 - 10 ** 7))
    set_clock(node, 10 ** 18 - 30 * 10 ** 9)
    assert watched.dog.complaint_about_clocks() == ''
    watched.pairing.take_colour(stamped(10 ** 18))
    assert 'stamped 30.0 s ahead' in watched.dog.complaint_about_clocks()


def test_one_driver_of_two_that_does_not_match_is_named(node, neighbours, steady):
    watched = Watched(node, steady, reliability='reliable')
    neighbours.offer('/depth/image', ReliabilityPolicy.RELIABLE, name='first')
    neighbours.offer('/depth/image', ReliabilityPolicy.BEST_EFFORT, name='second')
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert watched.complaint.startswith(
        'nothing on /depth/image for 5 s: the QoS of second does not match ours (')
    assert watched.complaint.endswith('); set qos_reliability to auto')


def test_a_topic_that_nobody_publishes_any_more_is_not_listed(watched, node, neighbours):
    node.create_subscription(Image, '/camera', print, 10)
    neighbours.withdraw(neighbours.offer('/camera'))
    assert '/camera' in dict(node.get_topic_names_and_types())
    watched.wait(6.0)
    assert 'there are images' not in watched.complaint


def test_of_images_and_rgbd_images_those_of_the_present_input_are_listed(
        node, neighbours, steady, rtabmap_msgs):
    from rtabmap_msgs.msg import RGBDImage
    neighbours.offer('/camera')
    neighbours.offer('/both', kind=RGBDImage)
    for is_rgbd, names, sentence in ((False, NAMES, 'there are images on /camera'),
                                     (True, ['rgbd_image'], 'there is an rgbd_image on /both')):
        watched = Watched(node, steady, names=names, subscribe_rgbd=is_rgbd)
        watched.wait(6.0)
        assert watched.complaint.endswith(sentence)


def test_any_message_ends_the_silence_of_the_camera(watched):
    watched.wait(3.0, ['depth/image'])
    watched.wait(1.0)
    assert watched.dog.silent_for() == pytest.approx(1.0)


def test_unpublished_topics_are_named_together(watched, neighbours):
    neighbours.offer('/rgb/image')
    watched.wait(6.0, ['rgb/image'])
    assert watched.complaint == (
        'nobody publishes /depth/image, /rgb/camera_info: start the camera, or remap '
        'depth/image, rgb/camera_info to its topics; one on another host is found only with the '
        'same ROS_DOMAIN_ID, within ROS_AUTOMATIC_DISCOVERY_RANGE, and if the network loses '
        'little')


@pytest.mark.parametrize('share, count, losses', [
    (0.9, 40, '90% of the images on /rgb/image do not arrive: if Fast DDS loses them'),
    (0.0, 3, 'in 5 s only few images arrive (3 on /rgb/image): if Fast DDS loses them')])
def test_where_images_are_lost_a_publisher_may_be_there_unseen(
        watched, neighbours, share, count, losses):
    """Its announcement travels as the images do."""
    neighbours.offer('/rgb/image')
    watched.pairing.missing_shares = {'rgb/image': share, 'depth/image': 0.0}
    watched.pairing.recent_counts = lambda seconds: {'rgb/image': count, 'depth/image': 0}
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert watched.complaint.startswith(
        f'no publisher of /depth/image is found, and {losses}')
    assert watched.complaint.endswith(
        '; otherwise start the camera, or remap depth/image to its topics')


def test_a_camera_that_lost_images_and_ended_is_to_be_started(watched):
    watched.pairing.missing_shares = {'rgb/image': 0.9, 'depth/image': 0.9}
    watched.pairing.recent_counts = lambda seconds: {'rgb/image': 0, 'depth/image': 0}
    watched.wait(6.0)
    assert watched.complaint.startswith('nobody publishes /rgb/image, /depth/image, ')


def test_a_topic_that_may_be_silent_is_not_named(watched):
    watched.subscriptions['rgb/camera_info'].may_be_silent = True
    watched.wait(6.0)
    assert '/depth/image' in watched.complaint
    assert 'camera_info' not in watched.complaint


def test_a_publisher_that_sends_nothing_is_named(watched, neighbours):
    neighbours.offer('/depth/image', name='driver')
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert watched.complaint.startswith(
        'nothing on /depth/image for 5 s, though driver is there: it sends no images, or none '
        'arrives; if Fast DDS loses them, start the driver with config/fastdds.xml')


def test_a_publisher_that_sends_no_calibration_is_named(watched, neighbours):
    """It is small: Fast DDS does not lose it."""
    neighbours.offer('/rgb/camera_info', name='driver', kind=CameraInfo)
    watched.wait(6.0, ['rgb/image', 'depth/image'])
    watched.pairing.paired_at = math.inf
    assert watched.complaint == ('nothing on /rgb/camera_info for 5 s: driver is there but sends '
                                 'nothing')


@pytest.mark.parametrize('shares, counts, reason', [
    ((0.9, 0.0), (150, 150), '90% of the images on /rgb/image do not arrive: if Fast DDS'),
    ((0.0, 0.0), (3, 150), 'only few images arrive (3 on /rgb/image), and no two of them'),
    ((0.0, 0.0), (3, 9), '(3 on /rgb/image, 9 on /depth/image)')])
def test_images_that_are_lost_are_no_camera_to_synchronise(watched, shares, counts, reason):
    watched.pairing.missing_shares = dict(zip(NAMES, shares))
    watched.pairing.recent_counts = lambda seconds: dict(zip(NAMES, counts))
    watched.wait(6.0, NAMES)
    assert reason in watched.complaint
    assert 'config/fastdds.xml' in watched.complaint
    assert 'on another host with config/fastdds_wireless.xml' in watched.complaint
    assert 'synchronize' not in watched.complaint


def test_a_publisher_whose_qos_does_not_match_is_explained(node, neighbours, steady):
    watched = Watched(node, steady, reliability='reliable')
    neighbours.offer('/depth/image', ReliabilityPolicy.BEST_EFFORT, name='driver')
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert 'the QoS of driver does not match ours' in watched.complaint
    assert 'set qos_reliability to auto' in watched.complaint


@pytest.mark.parametrize('name, parameter', [
    ('rgb/image', 'image_transport'), ('depth/image', 'depth_transport')])
def test_another_transport_of_a_silent_topic_is_named(watched, neighbours, name, parameter):
    neighbours.offer(f'/{name}/compressed')
    watched.wait(6.0, set(NAMES) - {name})
    assert watched.complaint.endswith(
        f'there is /{name}/compressed: set {parameter} to compressed')


def test_the_topic_of_one_image_is_no_place_to_look_for_the_other(watched, neighbours):
    for topic in ('/rgb/image', '/camera'):
        neighbours.offer(topic)
    watched.wait(6.0, ['rgb/image', 'rgb/camera_info'])
    assert watched.complaint.endswith('there are images on /camera')


def test_topics_with_images_are_listed_but_those_of_this_package(watched, neighbours):
    for i in range(8):
        neighbours.offer(f'/camera{i}')
    neighbours.offer('/a/debug_image')
    neighbours.offer('/a/text', kind=String)
    watched.wait(6.0)
    listed = ', '.join(f'/camera{i}' for i in range(6))
    assert watched.complaint.endswith(f'there are images on {listed}')


@pytest.mark.parametrize('subscribed, topic, kind, sentence', [
    (False, '/camera/rgbd_image', 'RGBDImage',
     'there is an rgbd_image on /camera/rgbd_image: set subscribe_rgbd to true for it'),
    (True, '/camera/rgbd_image', 'RGBDImage', 'there is an rgbd_image on /camera/rgbd_image'),
    (True, '/camera/image', 'Image',
     'there are images on /camera/image: set subscribe_rgbd to false for them'),
    (True, '/rgbd_image/compressed', 'RGBDImage',
     'there is /rgbd_image/compressed: remap rgbd_image to it')])
def test_what_another_input_would_receive_is_named(
        node, neighbours, steady, rtabmap_msgs, subscribed, topic, kind, sentence):
    from rtabmap_msgs.msg import RGBDImage
    names = ['rgbd_image'] if subscribed else NAMES
    watched = Watched(node, steady, names=names, subscribe_rgbd=subscribed)
    neighbours.offer(topic, kind=Image if kind == 'Image' else RGBDImage)
    neighbours.offer('/a/odom_rgbd_image', kind=RGBDImage)  # our own
    watched.wait(6.0)
    assert watched.complaint.endswith(sentence)


def test_topics_with_images_are_not_listed_for_a_missing_camera_info(watched, neighbours):
    neighbours.offer('/camera')
    watched.wait(6.0, ['rgb/image', 'depth/image'])
    watched.pairing.paired_at = math.inf
    assert 'there are images' not in watched.complaint


@pytest.mark.parametrize('settings, remedy', [
    ({}, 'within approx_sync_max_interval = 0.02 s: synchronize the camera'),
    ({'approx_sync': False}, 'the same stamp: set approx_sync to true')])
def test_images_that_do_not_pair_are_explained(node, steady, settings, remedy):
    watched = Watched(node, steady, **settings)
    watched.wait(4.9, NAMES)
    assert watched.complaint == ''
    watched.wait(0.2, NAMES)
    assert remedy in watched.complaint


def test_a_recent_rejection_is_the_reason_where_nothing_pairs(watched, steady):
    watched.wait(6.0, NAMES)
    watched.pairing.rejected_at, watched.pairing.rejection = steady.now, 'image rejected: why'
    assert watched.complaint == 'image rejected: why'
    watched.wait(5.1, NAMES)
    assert 'image rejected' not in watched.complaint


@pytest.mark.parametrize('colour, depth, named', [
    (0.0, 0.2, []), (0.21, 0.0, ['21% of the images on /rgb/image']),
    (0.5, 0.4, ['50% of the images on /rgb/image', '40% of the images on /depth/image'])])
def test_losses_beyond_a_fifth_are_named(watched, colour, depth, named):
    watched.pairing.missing_shares = {'rgb/image': colour, 'depth/image': depth}
    complaint = watched.dog.complaint_about_losses()
    assert complaint.startswith(' and '.join(named))
    assert ('config/fastdds.xml' in complaint) == bool(named)


@pytest.mark.parametrize('now, ahead, sentence', [
    (0, 0, 'nobody publishes /clock'), (10 ** 18, 0, ''), (10 ** 18, 900_000_000, ''),
    (10 ** 18, 1_500_000_000, "stamped 1.5 s ahead of this node's clock"),
    (10 ** 18, -10 ** 12, '')])  # of a recording
def test_clocks_that_differ_are_explained(watched, node, now, ahead, sentence):
    set_clock(node, now)
    watched.pairing.ahead = ahead
    complaint = watched.dog.complaint_about_clocks()
    assert sentence in complaint
    assert bool(complaint) == bool(sentence)
