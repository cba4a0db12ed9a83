# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The topic of an IMU: which samples go with a frame, what is waited for and what is said."""

import math
from time import sleep

import numpy as np
import pytest
from geometry_msgs.msg import Vector3
from rclpy.clock import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import Imu

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.ros.conversions import to_time
from aick_ros.ros.input.imu import ImuInput
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.tf_messages import TF_REMEDY

MS = 10 ** 6
OPTICAL = 'camera_rgb_optical_frame'
IDENTITY = {(OPTICAL, 'imu_frame'): np.eye(4)}


class Driver:
    """
    A driver of an IMU, and the input of a node.

    :ivar changes: a list that grows by each change.
    """

    def __init__(self, node, neighbours, is_required):
        self.node, self._neighbours, self.changes = node, neighbours, []
        self.transforms = Transforms(node, ('odom', 'base_link'), lambda: None)
        self.source = ImuInput(node, self.transforms, lambda: self.changes.append(1), is_required)
        self._publisher = neighbours.offer('imu', ReliabilityPolicy.BEST_EFFORT, kind=Imu)

    @property
    def subscription(self):
        [found] = [each for each in self.node.subscriptions if each.topic_name == '/imu']
        return found

    @property
    def timer(self):
        [found] = self.node.timers
        return found

    @property
    def is_polled(self):
        return not self.timer.is_canceled()

    def publish(self, milliseconds, **values):
        """Have a sample arrive."""
        self._neighbours.wait_until(self.subscription.get_publisher_count, 'the driver')
        self._neighbours.send(self._publisher, message(milliseconds, **values))

    def send(self, milliseconds, **values):
        """Have a sample arrive, and let the timer run, if it does."""
        self.publish(milliseconds, **values)
        if self.is_polled:
            self.timer.callback()


@pytest.fixture
def made(node, neighbours, tell_tf):
    """Return a function that makes the input of a driver that publishes, with links of TF."""
    def make(links=IDENTITY, is_required=False):
        driver = Driver(node, neighbours, is_required)
        tell_tf(links)
        driver.source.activate()
        return driver.source, driver
    return make


def message(milliseconds, rate=(0.1, 0.2, 0.3)):
    result = Imu(angular_velocity=Vector3(**dict(zip('xyz', rate))))
    result.header.stamp, result.header.frame_id = to_time(milliseconds * MS), 'imu_frame'
    return result


def move(driver, tell_tf, stamp):
    """Have the IMU move on the camera, and known where it is at a stamp alone [ns]."""
    assert driver.transforms.find(OPTICAL, 'imu_frame', 0) is None
    driver.transforms.tend()
    tell_tf(IDENTITY, '/tf', stamp)


def test_it_is_subscribed_to_as_every_driver_offers_it(made):
    """A reliable subscription would not match a driver that publishes with best effort."""
    qos = made()[1].subscription.qos_profile
    assert qos.reliability is ReliabilityPolicy.BEST_EFFORT
    assert qos.depth >= 4000  # seconds without an image, at 1 kHz


def test_it_is_looked_for_by_a_clock_that_never_stands_still_and_often(made):
    _, driver = made()
    assert driver.timer.clock.clock_type is ClockType.STEADY_TIME
    assert driver.timer.timer_period_ns <= 5 * MS  # an image waits this much longer
    assert not driver.is_polled


def test_an_imu_is_not_required_unless_it_is_said(node):
    source = ImuInput(node, Transforms(node, ('odom', 'base_link'), print), print)
    source.activate()
    assert source.reaches(0)
    assert source.complaint == ''


@pytest.mark.parametrize('after, has_arrived', [
    (-5 * MS, True), (0, True), (1, False), (50 * MS - 1, False), (50 * MS, True)])
def test_samples_are_waited_for_as_long_as_they_may_take(made, after, has_arrived):
    source, driver = made()
    driver.send(5)
    assert source.reaches(5 * MS + after) is has_arrived
    assert driver.is_polled is not has_arrived


def test_a_frame_gets_the_samples_since_the_one_before_in_its_axes(made):
    turn = se3.exp([1, 2, 3, 0.3, 0.2, -0.5])
    source, driver = made({(OPTICAL, 'imu_frame'): turn})
    assert source.samples(OPTICAL, 0) is None
    for time in (0, 5, 10):
        driver.send(time)
    samples = source.samples(OPTICAL, 8 * MS)
    assert samples.stamps.tolist() == [0, 5 * MS, 10 * MS]
    assert np.allclose(samples.turn_rates, turn[:3, :3] @ [0.1, 0.2, 0.3])
    assert len(source.samples(OPTICAL, 41 * MS)) == 0


def test_an_image_waits_for_samples_that_are_about_to_come(made):
    source, driver = made()
    assert source.reaches(0)  # there is no IMU
    driver.send(5)
    assert source.reaches(5 * MS)
    assert not source.reaches(12 * MS)
    driver.send(10)
    assert driver.changes == []
    driver.send(15)
    assert driver.changes == [1]
    assert source.reaches(12 * MS)
    assert source.reaches(80 * MS)  # it is late, or has stopped
    driver.send(20)
    assert driver.changes == [1]


def test_of_several_images_the_first_is_told_of_and_then_each_that_is_asked_for_again(made):
    """The oldest pair that waits and the newest one are asked for in turn."""
    source, driver = made()
    driver.send(5)
    for stamp in (12 * MS, 31 * MS):
        assert not source.reaches(stamp)
    driver.send(10)
    assert driver.changes == []
    driver.send(15)
    assert (driver.changes, driver.is_polled) == ([1], False)
    assert source.reaches(12 * MS)
    assert not source.reaches(31 * MS)
    driver.send(35)
    assert (driver.changes, driver.is_polled) == ([1, 1], False)


def test_an_image_that_is_reached_leaves_a_later_one_waiting(made):
    source, driver = made()
    driver.send(10)
    assert not source.reaches(12 * MS)
    assert source.reaches(8 * MS)
    driver.send(15)
    assert (driver.changes, driver.is_polled) == ([1], False)


def test_samples_are_looked_for_only_while_an_image_waits(made):
    source, driver = made()
    driver.send(5)
    assert not driver.is_polled
    queue = driver.subscription.handle
    with queue:
        assert queue.take_message(Imu, False) is not None  # nobody has taken it
    driver.send(5)
    assert source.reaches(5 * MS)
    assert not driver.is_polled
    assert not source.reaches(12 * MS)
    assert driver.is_polled
    assert source.reaches(80 * MS)  # a later image, which waits no more
    driver.timer.callback()
    assert (driver.is_polled, driver.changes) == (False, [])


def test_the_first_frame_waits_for_the_first_sample_where_it_is_required(made):
    source, driver = made(is_required=True)
    assert not source.reaches(100 * MS)
    assert source.complaint == ('the first frame waits for the IMU on /imu, by '
                                'wait_imu_to_init')
    driver.send(5)
    assert driver.changes == [1]
    assert source.reaches(100 * MS)
    assert source.complaint == ''
    assert len(source.samples(OPTICAL, 100 * MS)) == 1


def test_the_first_frame_waits_for_the_transform_too(made):
    source, driver = made({}, is_required=True)
    driver.send(5)
    with pytest.raises(InputError, match='no transform from .imu_frame'):
        source.samples(OPTICAL, 5 * MS)


def test_the_first_frame_waits_for_a_transform_that_moves_too(made, tell_tf):
    source, driver = made({}, is_required=True)
    move(driver, tell_tf, 3005 * MS)
    driver.send(5)
    with pytest.raises(InputError, match=f'^{MOVED}'):
        source.samples(OPTICAL, 5 * MS)


def test_only_the_first_frame_waits_for_the_transform(made, tell_tf):
    source, driver = made({}, is_required=True)
    move(driver, tell_tf, 5 * MS)
    driver.send(5)
    assert source.samples(OPTICAL, 5 * MS) is not None
    assert source.samples(OPTICAL, 3005 * MS) is None


NO_TRANSFORM = ("no transform from 'imu_frame' (the IMU) to 'camera_rgb_optical_frame' (the "
                f'colour image) yet: {TF_REMEDY}; until then the IMU is not used')
MOVED = ("the transform from 'imu_frame' to 'camera_rgb_optical_frame' moves, and the nearest one "
         'is 3.000 s from the image stamp: ')


@pytest.mark.parametrize('moves, sentence', [(False, NO_TRANSFORM), (True, MOVED)])
def test_without_a_transform_it_is_not_used_and_said_until_there_is_one(
        made, tell_tf, moves, sentence):
    source, driver = made({})
    if moves:
        move(driver, tell_tf, 3000 * MS)
    assert source.complaint == ''
    driver.send(5)
    assert source.samples(OPTICAL, 0) is None
    assert source.complaint.startswith(sentence)
    tell_tf(IDENTITY)
    assert len(source.samples(OPTICAL, 0)) == 1
    assert source.complaint == ''


def test_silence_of_more_than_a_second_is_said(made, steady):
    source, driver = made()
    driver.send(5)
    assert source.complaint == ''
    steady.now += 1.0
    assert source.complaint == ''
    steady.now += 2.2
    assert source.complaint == 'no sample of the IMU has come on /imu for 3 s'
    driver.send(10)
    assert source.complaint == ''


@pytest.mark.parametrize('first, image, sentence', [
    (5000, 6001, 'are stamped 1.0 s behind the images and are not used'),
    (5000, 3900, 'are stamped 1.1 s ahead of the images and are not used'),
    (5000, 6000, ''), (5000, 4000, '')])
def test_another_clock_is_said_until_the_stamps_agree(made, first, image, sentence):
    source, driver = made()
    driver.send(first)
    source.compare_clock(image * MS)
    assert sentence in source.complaint and bool(source.complaint) is bool(sentence)
    source.compare_clock(first * MS)
    assert source.complaint == ''


def test_an_image_that_waited_for_long_has_no_other_clock(made):
    source, driver = made()
    for time in (5, 9005):
        driver.send(time)
        source.compare_clock(5 * MS)
    assert source.complaint == ''


def test_without_samples_or_inactive_there_is_no_clock_to_compare(made):
    source, driver = made()
    source.compare_clock(5 * MS)
    assert source.complaint == ''
    source.deactivate()
    source.compare_clock(9005 * MS)
    assert source.complaint == ''


def test_the_node_says_another_clock_though_no_images_are_a_pair(rig, start_node, all_frames):
    """Through DDS; the camera sends no depth, so that there is no frame."""
    frame = all_frames[0]
    publisher = rig.node.create_publisher(Imu, 'imu', 1000)
    node = start_node()
    rig.wait_for_node()
    rig.wait_until(publisher.get_subscription_count, 'the node to subscribe to the IMU')
    stamps = iter(range(frame.stamp, frame.stamp + 10 ** 12, 33 * MS))

    def send():
        stamp = next(stamps)
        publisher.publish(message(stamp // MS - 100_000))
        rig.colour.publish(rig.image_message(stamp, 'rgb8', frame.colour))
        sleep(0.033)

    rig.wait_until(lambda: 's behind the images and are not used' in node.log, lambda: node.log,
                   send)
    assert not rig.odom


def test_an_image_that_waits_is_no_longer_waited_for_once_it_is_inactive(made):
    source, driver = made()
    driver.send(5)
    assert not source.reaches(12 * MS)
    poll = driver.timer.callback
    source.deactivate()
    source.activate()
    driver.send(15)
    poll()
    assert driver.changes == []
    assert not driver.is_polled
    assert not source.reaches(20 * MS)  # but samples are, again


def test_inactive_it_is_not_subscribed(made):
    source, driver = made()
    source.deactivate()
    source.deactivate()
    assert list(driver.node.timers) == []
    assert [each.topic_name for each in driver.node.subscriptions] == ['/tf_static']
    assert source.reaches(0)
    assert source.samples(OPTICAL, 0) is None


def test_while_an_image_waits_an_executor_takes_the_samples(made, neighbours):
    source, driver = made()
    driver.send(5)
    assert not source.reaches(12 * MS)
    executor = SingleThreadedExecutor(context=driver.node.context)
    executor.add_node(driver.node)
    driver.publish(15)
    neighbours.wait_until(lambda: driver.changes, 'the sample',
                          lambda: executor.spin_once(timeout_sec=0.1))
    executor.shutdown()
    assert not driver.is_polled
    assert source.reaches(12 * MS)


def test_the_node_uses_it(rig, start_node, all_frames):
    """Through DDS."""
    frames = all_frames[:4]
    publisher = rig.node.create_publisher(Imu, 'imu', 1000)
    start_node()
    rig.wait_until(publisher.get_subscription_count, 'the node to subscribe to the IMU')
    rig.send_camera_info(frames[0].camera)
    first = frames[0].stamp // MS
    for frame in frames:
        for time in range(first, frame.stamp // MS + 20, 5):
            sample = message(time, (0.0, 1e-4 * (time % 7), 0.0))
            sample.header.frame_id = OPTICAL
            publisher.publish(sample)
        first = time + 5
        rig.send(frame)
        rig.answer(frame.stamp)
    rig.wait_until(lambda: rig.values()['gyroscope'].startswith('bias ('), rig.values)


def test_samples_that_measure_nothing_are_said(made):
    source, driver = made()
    for stamp in range(100):
        assert source.complaint == ''
        driver.send(stamp, rate=3 * (math.nan,))
    assert source.complaint.startswith('the last 100 samples of the IMU on /imu have neither')
