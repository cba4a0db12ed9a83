# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The topic of an IMU: which samples go with a frame, what is waited for and what is said."""

from collections import deque
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import Vector3
from rclpy.clock import ClockType
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import Imu

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.ros.conversions import to_time
from aick_ros.ros.input import imu as imu_module
from aick_ros.ros.input.imu import ImuInput
from aick_ros.ros.tf_messages import TF_REMEDY

MS = 10 ** 6
OPTICAL = 'camera_rgb_optical_frame'


class Timer:
    """A timer that runs, or is cancelled."""

    def __init__(self, poll):
        self.poll, self.runs = poll, True

    def reset(self):
        self.runs = True

    def cancel(self):
        self.runs = False


class Handle(nullcontext):
    """Messages that wait in the middleware."""

    def __init__(self):
        super().__init__()
        self.waiting = deque()

    def take_message(self, kind, raw):
        return (self.waiting.popleft(), {}) if self.waiting else None


class Node:
    """What is used of a node; messages wait until they are taken."""

    def __init__(self):
        self.handle, self.destroyed, self.timer = Handle(), [], None

    def create_subscription(self, kind, topic, callback, qos, callback_group):
        assert (kind, topic) == (Imu, 'imu')
        self.qos = qos
        return SimpleNamespace(handle=self.handle)

    def create_timer(self, period, poll, clock):
        self.timer, self.period, self.clock_type = Timer(poll), period, clock.clock_type
        return self.timer

    def take(self, message):
        """Have a message arrive, and let the timer run, if it does."""
        self.handle.waiting.append(message)
        if self.timer.runs:
            self.timer.poll()

    def destroy_subscription(self, subscription):
        self.destroyed.append('subscription')

    def destroy_timer(self, timer):
        self.destroyed.append('timer')

    def resolve_topic_name(self, name):
        return f'/robot/{name}'


class Transforms:
    """A transform that is known, is not, or moves."""

    def __init__(self, answer):
        self.answer = answer

    def find(self, target, source, stamp):
        assert (target, source) == (OPTICAL, 'imu_frame')
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.fixture
def made():
    """Return a function that makes the input, its node, and a list that grows by each change."""
    def make(answer=np.eye(4), is_required=False):
        node, changes = Node(), []
        result = ImuInput(node, Transforms(answer), lambda: changes.append(1), is_required)
        result.activate()
        return result, node, changes
    return make


def message(milliseconds, rate=(0.1, 0.2, 0.3)):
    result = Imu(angular_velocity=Vector3(**dict(zip('xyz', rate))))
    result.header.stamp, result.header.frame_id = to_time(milliseconds * MS), 'imu_frame'
    return result


def test_it_is_subscribed_to_as_every_driver_offers_it(made):
    """A reliable subscription would not match a driver that publishes with best effort."""
    _, node, _ = made()
    assert node.qos.reliability is ReliabilityPolicy.BEST_EFFORT
    assert node.qos.depth >= 4000  # seconds without an image, at 1 kHz


def test_it_is_looked_for_by_a_clock_that_never_stands_still_and_often(made):
    _, node, _ = made()
    assert node.clock_type is ClockType.STEADY_TIME
    assert node.period <= 0.005  # an image waits this much longer
    assert not node.timer.runs


def test_an_imu_is_not_required_unless_it_is_said(made):
    node = Node()
    source = ImuInput(node, Transforms(np.eye(4)), lambda: None)
    source.activate()
    assert source.reaches(0)
    assert source.complaint == ''


@pytest.mark.parametrize('after, has_arrived', [
    (-5 * MS, True), (0, True), (1, False), (50 * MS - 1, False), (50 * MS, True)])
def test_samples_are_waited_for_as_long_as_they_may_take(made, after, has_arrived):
    source, node, _ = made()
    node.take(message(5))
    assert source.reaches(5 * MS + after) is has_arrived
    assert node.timer.runs is not has_arrived


def test_a_frame_gets_the_samples_since_the_one_before_in_its_axes(made):
    turn = se3.exp([1, 2, 3, 0.3, 0.2, -0.5])
    source, node, _ = made(turn)
    assert source.samples(OPTICAL, 0) is None
    for time in (0, 5, 10):
        node.take(message(time))
    samples = source.samples(OPTICAL, 8 * MS)
    assert samples.stamps.tolist() == [0, 5 * MS, 10 * MS]
    assert np.allclose(samples.turn_rates, turn[:3, :3] @ [0.1, 0.2, 0.3])
    assert len(source.samples(OPTICAL, 41 * MS)) == 0


def test_an_image_waits_for_samples_that_are_about_to_come(made):
    source, node, changes = made()
    assert source.reaches(0)  # there is no IMU
    node.take(message(5))
    assert source.reaches(5 * MS)
    assert not source.reaches(12 * MS)
    node.take(message(10))
    assert changes == []
    node.take(message(15))
    assert changes == [1]
    assert source.reaches(12 * MS)
    assert source.reaches(80 * MS)  # it is late, or has stopped
    node.take(message(20))
    assert changes == [1]


def test_samples_are_looked_for_only_while_an_image_waits(made):
    source, node, changes = made()
    node.take(message(5))
    assert not node.timer.runs
    assert len(node.handle.waiting) == 1
    assert source.reaches(5 * MS)
    assert not node.timer.runs
    assert not source.reaches(12 * MS)
    assert node.timer.runs
    assert source.reaches(80 * MS)  # a later image, which waits no more
    node.timer.poll()
    assert (node.timer.runs, changes) == (False, [])


def test_the_first_frame_waits_for_the_first_sample_where_it_is_required(made):
    source, node, changes = made(is_required=True)
    assert not source.reaches(100 * MS)
    assert source.complaint == ('the first frame waits for the IMU on /robot/imu, by '
                                'wait_imu_to_init')
    node.take(message(5))
    assert changes == [1]
    assert source.reaches(100 * MS)
    assert source.complaint == ''
    assert len(source.samples(OPTICAL, 100 * MS)) == 1


def test_the_first_frame_waits_for_the_transform_too(made):
    source, node, _ = made(None, is_required=True)
    node.take(message(5))
    with pytest.raises(InputError, match='no transform from .imu_frame'):
        source.samples(OPTICAL, 5 * MS)


def test_the_first_frame_waits_for_a_transform_that_moves_too(made):
    source, node, _ = made(InputError('it moves'), is_required=True)
    node.take(message(5))
    with pytest.raises(InputError, match='^it moves$'):
        source.samples(OPTICAL, 5 * MS)


def test_only_the_first_frame_waits_for_the_transform(made):
    source, node, _ = made(is_required=True)
    node.take(message(5))
    assert source.samples(OPTICAL, 5 * MS) is not None
    source._transforms.answer = None
    assert source.samples(OPTICAL, 10 * MS) is None


NO_TRANSFORM = ("no transform from 'imu_frame' (the IMU) to 'camera_rgb_optical_frame' (the "
                f'colour image) yet: {TF_REMEDY}; until then the IMU is not used')


@pytest.mark.parametrize('answer, sentence', [
    (None, NO_TRANSFORM), (InputError('it moves'), 'it moves')])
def test_without_a_transform_it_is_not_used_and_said_until_there_is_one(made, answer, sentence):
    source, node, _ = made(answer)
    assert source.complaint == ''
    node.take(message(5))
    assert source.samples(OPTICAL, 0) is None
    assert source.complaint == sentence
    source._transforms.answer = np.eye(4)
    assert len(source.samples(OPTICAL, 0)) == 1
    assert source.complaint == ''


def test_silence_of_more_than_a_second_is_said(made, monkeypatch):
    now = 1000.0
    monkeypatch.setattr(imu_module, 'time', SimpleNamespace(monotonic=lambda: now))
    source, node, _ = made()
    node.take(message(5))
    assert source.complaint == ''
    now += 1.0
    assert source.complaint == ''
    now += 2.2
    assert source.complaint == 'no sample of the IMU has come on /robot/imu for 3 s'
    node.take(message(10))
    assert source.complaint == ''


def test_an_image_that_waits_is_no_longer_waited_for_once_it_is_inactive(made):
    source, node, changes = made()
    node.take(message(5))
    assert not source.reaches(12 * MS)
    poll = node.timer.poll
    source.deactivate()
    source.activate()
    node.take(message(15))
    poll()
    assert changes == []
    assert not node.timer.runs
    assert not source.reaches(20 * MS)  # but samples are, again


def test_inactive_it_is_not_subscribed(made):
    source, node, _ = made()
    source.deactivate()
    source.deactivate()
    assert node.destroyed == ['subscription', 'timer']
    assert source.reaches(0)
    assert source.samples(OPTICAL, 0) is None


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
