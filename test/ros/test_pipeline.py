# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The way of a frame through the node, and requests between frames, on a node of rclpy."""

import threading
from array import array
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry as OdometryMessage
from nav_msgs.msg import Path
from rclpy.clock_type import ClockType
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter
from rclpy.time import Time
from sensor_msgs.msg import Image
from std_srvs.srv import Empty

from aick_ros.borders import no_memory
from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import NO_DISTORTION
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.messages.synchronizer import Pair
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import (
    from_pose, header, pose_with_covariance, to_stamp, transform_stamped)
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import values_of
from aick_ros.ros.input import rgbd_images
from aick_ros.ros.input.guess import StartByGuess
from aick_ros.ros.load_shedding import Step
from aick_ros.ros.output.rtabmap import RtabmapTopics
from aick_ros.ros.output.views import Views
from aick_ros.ros.pipeline import Pipeline
from aick_ros.settings import NodeSettings, Settings
from aick_ros.settings.parameter import with_values

STAMP = 1_700_000_000_000_000_000
MS = 1_000_000


class Seen:
    """
    An odometry that sees the camera at poses which the test sets.

    :ivar imu: what each frame was given of an IMU.
    :ivar predict: by which the motion of a lost camera is asked for.
    """

    def __init__(self):
        self.pose, self.status, self.imu, self.resets = np.eye(4), Status.OK, [], 0
        self.misalignment = SimpleNamespace(values=np.zeros(8), description='')
        self.distortion = NO_DISTORTION
        self.gyroscope = SimpleNamespace(complaint='', description='gyroscope of a test')
        self.gravity = SimpleNamespace(complaint='', description='gravity of a test')
        self.plane = SimpleNamespace(complaint='')

    def prepare(self, frame):
        return SimpleNamespace(frame=frame, add_imu=self.imu.append)

    def register(self, preparation, predict=None, T_base_camera=None):
        self.T_base_camera, self.predict = T_base_camera, predict
        prepared = SimpleNamespace(frame=preparation.frame, keypoints=(), repeat=None)
        return OdometryUpdate(preparation.frame.stamp, self.status, 'a reason',
                              PoseWithCovariance(self.pose), prepared)

    def reset(self):
        self.pose, self.resets = np.eye(4), self.resets + 1

    def change_settings(self, settings):
        self.settings = settings


@cache
def content(size):
    return array('B', bytes(size))


def message(stamp, size=0):
    return Image(header=header(stamp, 'optical'), data=content(size))


class Stream:
    """The images of a camera, as far as the pipeline asks for them."""

    def __init__(self, *arguments):
        self.arguments, self.newest, self.is_closed = arguments, None, False
        self.counts, self.text = {}, ''

    def complaint(self):
        return self.text

    def close(self):
        self.is_closed = True


class Rig:
    """
    A pipeline on a node whose clock stands still and whose jobs the test does.

    :ivar robot: the odometry of the robot, and ``outputs`` what is published of it.
    :ivar shown: the arguments of what is displayed.
    """

    def __init__(self, graph, monkeypatch, cores=1, core=Settings(), namespace=None, **settings):
        self.graph, self.warmed, self.shown = graph, [], []
        monkeypatch.setattr('aick_ros.ros.pipeline.warm_up', self.warmed.append)
        monkeypatch.setattr('aick_ros.ros.pipeline.ImageStream', Stream)
        monkeypatch.setattr('os.sched_getaffinity', lambda process: set(range(cores)))
        self.node = graph.node(namespace=namespace, parameter_overrides=[
            Parameter('use_sim_time', value=True)])
        self.set_clock(STAMP)
        self.settings = NodeSettings(**{
            'camera_in_base': (0.0,) * 6 + (1.0,), 'publish_tf': False, **settings})
        self.pipeline = Pipeline(self.node, self.settings, core)
        self.robot, self.outputs = self.pipeline._odometry, self.pipeline._outputs
        self.camera = self.robot._camera = Seen()
        monkeypatch.setattr(self.pipeline._assembler, 'frame', lambda arrival: SimpleNamespace(
            stamp=arrival.pair.colour_stamp))
        monkeypatch.setattr(self.outputs._views, 'show',
                            lambda *arguments: self.shown.append(arguments))
        monkeypatch.setattr(self.outputs._rtabmap, 'show',
                            lambda update, base: self.shown.append(update))
        graph.listen(OdometryMessage, self.node.resolve_topic_name('odom'))
        self.reports = graph.listen(DiagnosticArray, '/diagnostics')

    def set_clock(self, nanoseconds):
        self.node.get_clock().set_ros_time_override(
            Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME))

    def work(self):
        """Do what waits."""
        queue = self.pipeline._queue
        while queue.backlog or queue._tasks:
            queue.take(self.pipeline._prepare_and_answer, lambda arrival: True)()

    def see(self, *stamps):
        for stamp in stamps:
            self.pipeline._enqueue(pair(stamp))
            self.work()

    def call_now(self, name):
        self.graph.call(self.node, Empty, f'odom_node/{name}')

    def call(self, name):
        self.call_now(name)
        self.work()

    @property
    def odom(self):
        return self.graph.sent(self.node, 'odom')

    @property
    def poses(self):
        return [from_pose(message.pose.pose) for message in self.odom]

    @property
    def status(self):
        """The last status on /diagnostics."""
        return self.graph.sent(self.node, '/diagnostics')[-1].status[0]

    @property
    def values(self):
        return {value.key: value.value for value in self.status.values}

    @property
    def log(self):
        """Level and text of each line."""
        return self.graph.log(self.node)

    @property
    def subscribed(self):
        return [each.topic_name for each in self.node.subscriptions]

    @property
    def snapshot(self):
        return self.pipeline._diagnostics.snapshot()


@pytest.fixture
def make(graph, monkeypatch):
    return lambda **settings: Rig(graph, monkeypatch, **settings)


def pair(stamp, depth_stamp=None, size=0, depth_size=0):
    """A pair of images of so many bytes."""
    depth_stamp = stamp + 7 * MS if depth_stamp is None else depth_stamp
    return Pair(stamp, message(stamp, size), depth_stamp, message(depth_stamp, depth_size))


def test_the_age_of_an_answer_is_that_of_its_image(make):
    made = make()
    made.set_clock(STAMP + 50 * MS)
    made.see(STAMP)
    assert values_of(made.snapshot)['delay since the stamp [ms]'] == '50.0'
    assert made.snapshot.delays[0] < 10_000.0


def test_a_reset_forgets_the_way_on_every_topic(make, monkeypatch):
    made, forgotten = make(), []
    for part in (made.outputs._views, made.outputs._rtabmap, made.robot._start):
        monkeypatch.setattr(part, 'reset', lambda part=part: forgotten.append(type(part)))
    made.camera.pose = se3.exp([1, 0, 0, 0, 0, 0])
    made.see(STAMP, STAMP + 33 * MS)
    made.call('reset_odom')
    made.see(STAMP + 66 * MS)
    assert forgotten == [StartByGuess, Views, RtabmapTopics]
    np.testing.assert_allclose(made.poses[-1], np.eye(4))


@pytest.mark.parametrize('name, count, answered', [
    ('pause_odom', Count.SKIPPED_WHILE_PAUSED, 1), ('reset_odom', Count.DROPPED_BY_RESET, 2)])
def test_what_waits_for_its_turn_is_not_answered_after_a_request(make, name, count, answered):
    made = make(process_every_frame=True)
    made.see(STAMP)
    for i in range(1, 4):
        made.pipeline._enqueue(pair(STAMP + i * 33 * MS))
    waiting = made.pipeline._queue._items[0]
    assert not made.pipeline._is_ready(waiting)  # for a calibration
    made.call_now(name)
    assert made.pipeline._is_ready(waiting)
    made.work()
    made.see(STAMP + 4 * 33 * MS)
    assert len(made.odom) == answered
    assert made.snapshot.totals[count] == (3 if name == 'reset_odom' else 4)


def test_what_is_prepared_ahead_is_not_answered_after_a_request(make):
    made = make()
    made.pipeline._enqueue(pair(STAMP))
    prepared = made.pipeline._prepare(made.pipeline._queue._items[0])
    made.call_now('pause_odom')
    made.pipeline._answer(prepared)
    assert made.odom == [] and made.snapshot.totals[Count.SKIPPED_WHILE_PAUSED] == 1


def test_what_is_skipped_damaged_or_failed_is_counted_as_such(make, monkeypatch):
    made = make(max_update_rate=10.0)
    made.see(*(STAMP + i * 50 * MS for i in range(6)))
    made.call('pause_odom')
    made.see(STAMP + 1000 * MS)
    made.call('resume_odom')

    monkeypatch.setattr(made.pipeline._assembler, 'frame', raises(InputError('it is damaged')))
    made.see(STAMP + 2000 * MS)
    monkeypatch.setattr(made.pipeline._assembler, 'frame', raises(ZeroDivisionError()))
    made.see(STAMP + 3000 * MS, STAMP + 4000 * MS)
    totals = made.snapshot.totals
    assert {count: totals[count] for count in (
        Count.ANSWERED, Count.SKIPPED_BY_RATE_LIMIT, Count.SKIPPED_WHILE_PAUSED, Count.DAMAGED,
        Count.FAILED)} == {Count.ANSWERED: 3, Count.SKIPPED_BY_RATE_LIMIT: 3,
                           Count.SKIPPED_WHILE_PAUSED: 1, Count.DAMAGED: 1, Count.FAILED: 2}


def test_it_is_warm_before_the_first_frame_with_the_settings_of_the_algorithm(make):
    core = with_values(Settings(), {'features.max_keypoints': 300})
    made = make(core=core)
    made.see(STAMP)
    assert made.warmed == [core]


def test_without_the_messages_that_a_setting_needs_it_does_not_begin(make, monkeypatch):
    monkeypatch.setattr(rgbd_images, 'RGBDImage', None)
    with pytest.raises(InputError, match='subscribe_rgbd is true, and rtabmap_msgs is not inst'):
        make(subscribe_rgbd=True)


@pytest.mark.parametrize('guess, ours, other', [
    ('', 'base_link', 'wheels'), ('wheels', 'wheels', 'base_link')])
def test_the_transform_that_it_publishes_is_not_heard(make, guess, ours, other):
    """With a guess that is odom -> guess; base_link has its parent from elsewhere then."""
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    made = make(guess_frame_id=guess)
    transforms = made.pipeline._transforms
    for frame in (ours, other):
        transforms.find('odom', frame, STAMP)
    transforms.tend()
    robot = made.graph.beside.create_publisher(tf2_msgs.TFMessage, '/tf', 10)
    made.graph.wait_until(robot.get_subscription_count, 'who hears of transforms')
    robot.publish(tf2_msgs.TFMessage(transforms=[
        transform_stamped(STAMP, 'odom', frame, np.eye(4)) for frame in (ours, other)]))
    made.graph.wait_until(lambda: transforms.find('odom', other, STAMP) is not None,
                          'the transform', made.node)
    assert transforms.find('odom', ours, STAMP) is None


@pytest.mark.parametrize('is_required', [False, True])
def test_the_first_frame_waits_for_an_imu_where_a_setting_says_so(make, is_required):
    made = make(wait_imu_to_init=is_required)
    assert made.pipeline._imu.reaches(STAMP) is not is_required
    assert bool(made.pipeline._imu.complaint) is is_required


@pytest.fixture
def active(make):
    """Return a pipeline that takes images and whose thread runs, and its images."""
    made = make(frame_id='body')
    made.pipeline.start()
    made.pipeline._diagnostics.count(Count.LOST)
    assert '/imu' not in made.subscribed
    made.pipeline.activate()
    yield made, made.pipeline._images
    made.pipeline.deactivate()
    made.pipeline.close()


def test_active_it_takes_images_and_reports_by_a_clock_that_never_stands_still(active):
    made, images = active
    pipeline = made.pipeline
    assert images.arguments == (made.node, made.settings, pipeline._assembler,
                                pipeline._transforms, pipeline._diagnostics, pipeline._enqueue,
                                pipeline._imu.compare_clock)
    assert (10 ** 9, ClockType.STEADY_TIME) in [
        (timer.timer_period_ns, timer.clock.clock_type) for timer in made.node.timers]
    assert made.snapshot.totals[Count.LOST] == 0  # of a life before
    assert '/imu' in made.subscribed
    images.text = 'no camera_info'
    made.graph.wait_until(lambda: made.reports, 'the report', made.node)
    assert made.reports[0].status[0].message == 'no camera_info'


def test_inactive_it_takes_nothing_and_forgets_what_waits(active, monkeypatch):
    made, images = active
    pipeline = made.pipeline
    monkeypatch.setattr(pipeline._assembler, 'missing_for', lambda pair: 'everything')
    for i in range(4):
        pipeline._enqueue(pair(STAMP + i * 33 * MS))
    assert (pipeline._queue.backlog, pipeline._worker.dropped) == (1, 3)
    for _ in range(2):
        pipeline.deactivate()
        assert images.is_closed
        assert list(made.node.timers) == []
        assert '/imu' not in made.subscribed
        assert (pipeline._queue.backlog, pipeline._worker.dropped) == (0, 0)
    assert pipeline._imu.reaches(STAMP)  # what does not come is not waited for


@pytest.mark.parametrize('unready, is_ready', [
    ((), True), (('old',), True), (('old', 'new'), False), (('new',), True)])
@pytest.mark.parametrize('what', ['transform', 'imu'])
def test_a_pair_waits_until_it_or_the_newest_one_can_be_answered(
        active, monkeypatch, what, unready, is_ready):
    made, images = active
    stamps = {'old': STAMP, 'new': STAMP + 33 * MS}
    missing = {stamps[name] for name in unready}
    monkeypatch.setattr(
        made.pipeline._assembler, 'missing_for',
        lambda each: 'it' if what == 'transform' and each.colour_stamp in missing else '')
    monkeypatch.setattr(made.pipeline._imu, 'reaches',
                        lambda stamp: what == 'transform' or stamp not in missing)
    images.newest = pair(stamps['new'])
    arrival = made.pipeline._assembler.arrival(pair(stamps['old']))
    assert made.pipeline._is_ready(arrival) is is_ready
    images.newest = None
    assert made.pipeline._is_ready(arrival) is ('old' not in unready)


def test_the_base_moves_as_the_camera_does_where_it_sits(make):
    """By the change of axes of a rigid body, T_base0_base1 = T_bc T_camera0_camera1 T_bc^-1."""
    T_base_camera = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
    made = make(camera_in_base=(0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5), frame_id='body',
                odom_frame_id='start', initial_pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.5))
    made.see(STAMP)
    made.camera.pose = se3.exp([0.2, -0.1, 0.4, 0.3, 0.2, 0.1])
    made.see(STAMP + 100 * MS)
    np.testing.assert_allclose(made.camera.T_base_camera, T_base_camera, atol=1e-12)
    start = se3.from_roll_pitch_yaw(0.0, 0.0, 0.5, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(made.poses[0], start, atol=1e-9)
    expected = start @ T_base_camera @ made.camera.pose @ se3.inverse(T_base_camera)
    np.testing.assert_allclose(made.poses[1], expected, atol=1e-9)
    sent = made.odom[-1]
    assert (sent.header.frame_id, sent.child_frame_id) == ('start', 'body')
    # what is displayed is that frame, too, in the frame of the odometry
    made.graph.listen(Path, 'path')
    Views.show(made.outputs._views, *made.shown[-1])
    assert made.graph.sent(made.node, 'path')[-1].header.frame_id == 'start'
    registered, (frame, update, T_odom_base, T_shown, camera_frame) = made.shown[-2:]
    assert frame.stamp == update.stamp == registered.camera.stamp == STAMP + 100 * MS
    assert camera_frame == registered.camera_frame == 'optical'
    np.testing.assert_allclose(T_odom_base, expected, atol=1e-9)
    np.testing.assert_allclose(registered.base.pose.matrix, expected, atol=1e-9)
    for shown in (T_shown, registered.T_base_camera):
        np.testing.assert_allclose(shown, T_base_camera, atol=1e-12)


def test_a_corrected_extrinsic_is_that_of_a_fixed_camera_whatever_comes_meanwhile(
        make, monkeypatch):
    """Another message of fixed links comes while the frame is registered; the base rests."""
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    made = make(camera_in_base=(), frame_id='body')

    def hear(child, *place):
        made.pipeline._transforms._take_fixed(tf2_msgs.TFMessage(transforms=[
            transform_stamped(0, 'body', child, se3.exp(place))]))
    monkeypatch.setattr(made.pipeline._imu, 'samples', lambda *_: hear('laser', *np.zeros(6)))
    for stamp, height in ((STAMP, 1.0), (STAMP + 33 * MS, 1.1)):
        hear('optical', 0, 0, height, 0, 0, 0.2)
        made.see(stamp)
    for pose in made.poses:
        np.testing.assert_allclose(pose, np.eye(4), atol=1e-12)


@pytest.mark.parametrize('status', Status)
def test_each_frame_that_was_not_registered_is_warned_of(make, status):
    made = make()
    made.camera.status = status
    made.see(STAMP)
    assert [level for level, _ in made.log] == ([] if status.ok else [LoggingSeverity.WARN])


def test_the_rate_is_that_of_the_colour_images(make):
    made = make(max_update_rate=10.0)
    for i in range(5):
        made.pipeline._enqueue(pair(STAMP + i * 50 * MS, STAMP))
        made.work()
    assert [to_stamp(sent.header.stamp) for sent in made.odom] == [
        STAMP, STAMP + 100 * MS, STAMP + 200 * MS]


@pytest.mark.parametrize('guess, child', [('', 'base_link'), ('wheels', 'wheels')])
def test_tf_is_that_of_the_base_or_of_the_guess(make, monkeypatch, guess, child):
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    made = make(publish_tf=True, guess_frame_id=guess, wait_for_transform=0.0)
    if guess:
        monkeypatch.setattr(made.robot._guess, 'T_guess_base', lambda stamp: np.eye(4))
    made.graph.listen(tf2_msgs.TFMessage, '/tf')
    made.see(STAMP)
    [link] = made.graph.sent(made.node, '/tf')[-1].transforms
    assert (link.header.frame_id, link.child_frame_id) == ('odom', child)


@pytest.mark.parametrize('paused, active', [(False, True), (True, True), (False, False)])
def test_a_pose_that_is_set_knows_whether_frames_are_taken(make, monkeypatch, paused, active):
    made, given = make(), []
    monkeypatch.setattr(made.robot._base, 'set_pose', lambda *given_: given.append(given_))
    monkeypatch.setattr(made.pipeline, '_images', object() if active else None)
    if paused:
        made.call('pause_odom')
    pose = se3.exp([1, 2, 3, 0.1, 0.2, 0.3])
    publisher = made.graph.beside.create_publisher(PoseWithCovarianceStamped, 'set_pose', 1)
    made.graph.wait_until(publisher.get_subscription_count, 'who takes a pose')
    publisher.publish(pose_with_covariance(0, 'odom', pose, 2.0 * np.eye(6)))
    made.graph.wait_until(lambda: made.work() or given, 'the request', made.node)
    [(found, stands_still)] = given
    np.testing.assert_allclose(found.matrix, pose, atol=1e-12)
    np.testing.assert_array_equal(found.covariance, 2.0 * np.eye(6))
    assert stands_still is (paused or not active)
    monkeypatch.setattr(made.pipeline, '_images', None)  # what closes it takes it for the stream


def test_a_lost_frame_is_warned_of_with_its_reason_and_a_tracked_one_is_not(make):
    made = make()
    made.see(STAMP)
    assert made.log == []
    made.camera.status = Status.TOO_FEW_MATCHES
    made.see(STAMP + 33 * MS)
    assert made.log == [(LoggingSeverity.WARN, f'frame {STAMP + 33 * MS} ns: '
                         f'{Status.TOO_FEW_MATCHES.value}: a reason')]
    assert made.odom[-1].pose.covariance[0] == 9999.0
    assert made.snapshot.totals[Count.LOST] == 1


def raises(error):
    def fail(*_):
        raise error
    return fail


def test_freed_memory_is_released_every_ten_seconds(make, monkeypatch):
    made, released = make(), []
    monkeypatch.setattr('aick_ros.ros.pipeline.release_freed_memory', lambda: released.append(1))
    monkeypatch.setattr(made.pipeline._worker, 'put_task', lambda task: task())
    for _ in range(29):
        made.pipeline._each_second(Stream())
    assert released == [1, 1]


def lose(made, images):
    made.camera.status = Status.TOO_FEW_MATCHES
    made.see(*(STAMP + i * MS for i in range(20)))


def damage(made, images):
    made.pipeline._assembler.frame = raises(InputError('it is damaged'))
    made.see(*(STAMP + i * MS for i in range(20)))


def fail(made, images):
    made.pipeline._assembler.frame = raises(ZeroDivisionError())
    made.see(*(STAMP + i * MS for i in range(20)))


def complain(made, images):
    images.text = 'no depth'
    for _ in range(20):
        made.pipeline._each_second(images)


@pytest.mark.parametrize('what', [lose, damage, fail, complain])
def test_what_lasts_is_not_logged_each_time(make, what):
    made = make()
    what(made, Stream())
    assert 0 < len(made.log) < 20  # once, on a machine that takes less than the pause of the log


def test_a_frame_that_cannot_be_used_or_fails_is_named_in_the_log(make, monkeypatch):
    made = make()
    for error, stamp in ((InputError('it is damaged'), STAMP), (ZeroDivisionError('of ours'), 5)):
        monkeypatch.setattr(made.pipeline._assembler, 'frame', raises(error))
        made.see(stamp)
    damaged, (level, failed) = made.log
    assert damaged == (LoggingSeverity.WARN, f'frame {STAMP} ns skipped: it is damaged')
    assert level is LoggingSeverity.ERROR
    assert failed.startswith('frame 5 ns failed, please report this:\nTraceback')
    assert 'ZeroDivisionError: of ours' in failed
    assert made.snapshot.reason == 'internal error, see the log'


def test_a_frame_without_memory_is_no_defect(make, monkeypatch):
    made = make()
    monkeypatch.setattr(made.pipeline._assembler, 'frame', raises(MemoryError()))
    made.see(STAMP)
    assert made.log == [
        (LoggingSeverity.WARN, f'frame {STAMP} ns skipped: {no_memory.SENTENCE}')]
    assert made.snapshot.reason == no_memory.SENTENCE


def test_what_fails_because_ros_ends_is_no_defect(make, monkeypatch, capfd):
    made = make()
    rclpy.shutdown()
    monkeypatch.setattr(made.pipeline._assembler, 'frame', raises(ZeroDivisionError()))
    made.see(STAMP)
    assert capfd.readouterr().err == ''
    assert made.snapshot.totals[Count.FAILED] == 0


def test_a_request_that_fails_does_not_end_the_odometry(make, monkeypatch):
    made = make()
    monkeypatch.setattr(made.camera, 'reset', lambda: 1 / 0)
    made.call('reset_odom')
    [(level, line)] = made.log
    assert level is LoggingSeverity.ERROR
    assert line.startswith('failed between two frames, please report this:\nTraceback')
    assert 'ZeroDivisionError' in line
    made.see(STAMP)
    assert len(made.poses) == 1


def test_a_reset_to_a_pose_begins_there_and_the_views_anew(make, monkeypatch):
    made, forgotten = make(initial_pose=(9.0,) + (0.0,) * 5), []
    for part in (made.outputs._views, made.outputs._rtabmap):
        monkeypatch.setattr(part, 'reset', lambda part=part: forgotten.append(type(part)))
    made.see(STAMP)
    T_odom_base = se3.exp([1, 2, 3, 0.1, 0.2, 0.3])
    made.pipeline._requests._reset(PoseWithCovariance(T_odom_base, 4.0 * np.eye(6)))
    made.see(STAMP + 33 * MS)
    assert (forgotten, made.camera.resets) == ([Views, RtabmapTopics], 1)
    np.testing.assert_allclose(made.poses[-1], T_odom_base, atol=1e-9)


def test_the_report_has_what_is_missing_and_what_waits(active):
    made, images = active
    pipeline, odometry = made.pipeline, made.camera
    images.text, images.counts = 'no depth', {Count.DEPTH_MISSING: 4, Count.COLOUR_UNPAIRED: 5}
    odometry.gyroscope.complaint, odometry.gravity.complaint = 'turns', 'falls'
    made.robot._camera_report.update(SimpleNamespace(
        values=np.zeros(8), description='rotated by 1 degree'), NO_DISTORTION)
    for _ in range(2):  # what is counted elsewhere is counted once
        pipeline._each_second(images)
    assert made.status.message == 'no depth; turns; falls'
    assert made.log[-1] == (LoggingSeverity.WARN, 'no depth; turns; falls')
    values = made.values
    assert {key: values[key] for key in (
        'backlog', 'backlog in MB', 'misalignment of the camera', 'gyroscope', 'accelerometer',
        'dropped to shed load', 'depth images that did not arrive', 'colour images without depth',
        'frames dropped under load')} == {
            'backlog': '0', 'backlog in MB': '0.0',
            'misalignment of the camera': 'rotated by 1 degree',
            'gyroscope': 'gyroscope of a test', 'accelerometer': 'gravity of a test',
            'dropped to shed load': 'nothing', 'depth images that did not arrive': '4',
            'colour images without depth': '5', 'frames dropped under load': '0'}


def test_where_nothing_is_missing_the_report_is_not_logged(active, monkeypatch):
    made, images = active
    made.pipeline._each_second(images)
    assert made.log == []
    made.call_now('pause_odom')
    made.pipeline._each_second(images)
    assert made.status.message.startswith('paused: ')


@pytest.mark.parametrize('every, count, size, kept', [
    (False, 2, 10, 2), (False, 4, 10, 1), (True, 99, 10, 99), (True, 150, 10, 100),
    (True, 10, 2 ** 25, 8)])
def test_a_backlog_is_bounded_in_number_and_in_size(make, every, count, size, kept):
    """A quarter of a GiB holds 8 pairs of 32 MiB."""
    made = make(process_every_frame=every)
    for i in range(count):
        made.pipeline._enqueue(pair(STAMP + i * 33 * MS, size=size))
    assert made.pipeline._queue.backlog == kept
    made.pipeline._each_second(Stream())
    assert made.snapshot.totals[Count.DROPPED_UNDER_LOAD] == count - kept


@pytest.fixture(scope='module')
def frames():
    """Return frames of a chequered slope that moves past the camera, by their stamps."""
    rng, camera = np.random.default_rng(1), Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    pattern = np.kron(rng.integers(0, 256, (24, 40), np.uint8), np.ones((10, 10), np.uint8))
    depth = np.broadcast_to(np.linspace(1.0, 1.2, 320, dtype=np.float32), (240, 320))
    return {STAMP + i * 33 * MS: RgbdFrame(
        STAMP + i * 33 * MS, np.ascontiguousarray(pattern[:, 2 * i:320 + 2 * i]),
        depth + np.float32(1e-3 * i), camera) for i in range(8)}


def test_frames_prepared_on_another_thread_are_answered_alike(make, monkeypatch, frames):
    paths = []
    for cores in (1, 2):
        made = make(cores=cores, namespace=f'cores_{cores}', process_every_frame=True)
        made.robot._camera = Odometry()
        monkeypatch.setattr(made.pipeline._assembler, 'missing_for', lambda pair: '')
        monkeypatch.setattr(made.pipeline._assembler, 'frame',
                            lambda arrival: frames[arrival.pair.colour_stamp])
        made.pipeline.start()
        threads = {thread.name for thread in threading.enumerate()}
        for stamp in frames:
            made.pipeline._enqueue(pair(stamp))
        made.graph.wait_until(lambda: made.snapshot.totals[Count.ANSWERED] >= len(frames),
                              'all answers')
        made.pipeline.close()
        assert ('preparation' in threads) is (cores == 2)
        answers = made.odom
        assert [to_stamp(message.header.stamp) for message in answers] == list(frames)
        paths.append([(from_pose(message.pose.pose), message.pose.covariance)
                      for message in answers])
        assert made.snapshot.totals[Count.LOST] == 0
    for (pose, covariance), (other, other_covariance) in zip(*paths, strict=True):
        np.testing.assert_array_equal(pose, other)
        np.testing.assert_array_equal(covariance, other_covariance)


def overload(made, monkeypatch, seconds):
    """Let seconds pass in which a third of the frames is dropped and the worker never waits."""
    worker = SimpleNamespace(dropped=0, busy=(0.0,), put_task=lambda task: task())
    monkeypatch.setattr(made.pipeline, '_worker', worker)
    for second in range(seconds + 1):
        monkeypatch.setattr('aick_ros.ros.load_control.time', SimpleNamespace(
            monotonic=lambda: 1e3 + second))
        made.pipeline._each_second(Stream())
        for _ in range(30):
            made.pipeline._load.admits_next()
        worker.dropped, worker.busy = worker.dropped + 10, (worker.busy[0] + 1.0,)


def test_under_load_less_is_computed_and_settings_can_change_all_the_same(make, monkeypatch):
    made = make()
    overload(made, monkeypatch, 2)
    assert made.camera.settings.features.max_keypoints == 200
    level, sentence = made.log[-1]
    assert level is LoggingSeverity.WARN
    assert 'half of the keypoints are dropped' in sentence
    made.pipeline.change_settings(with_values(Settings(), {'features.max_keypoints': 300}))
    assert made.camera.settings.features.max_keypoints == 150


def test_what_is_dropped_under_load_is_reported_and_its_end_is_logged(make, monkeypatch):
    made = make()
    overload(made, monkeypatch, 2)
    _, sentence = made.log[-1]
    assert sentence.startswith('frames come faster than they can be registered: half of the key')
    made.pipeline._each_second(Stream())
    assert made.status.message.endswith(sentence)
    assert made.values['dropped to shed load'] == 'half of the keypoints'
    shedding = made.pipeline._load._shedding
    shedding.step, shedding.update = Step.ALL, lambda load: True
    made.pipeline._each_second(Stream())
    assert made.log[-1] == (LoggingSeverity.WARN, 'everything is computed again')
    assert made.camera.settings == Settings()


def test_under_a_load_that_stays_every_second_frame_is_skipped(make, monkeypatch):
    made = make()
    overload(made, monkeypatch, 6)
    for i in range(6):
        stamp = STAMP + i * 33 * MS
        made.pipeline._enqueue(pair(stamp))
    assert made.snapshot.totals[Count.SKIPPED_TO_SHED_LOAD] == 3


def test_a_late_transform_is_named_and_is_no_load(make):
    made = make()
    for i in range(4):
        made.pipeline._enqueue(pair(STAMP + i * 33 * MS))
    made.pipeline._each_second(Stream())
    for _ in range(3):
        made.pipeline._transforms._lateness.note('base_link', 'camera', 0.35)
    for i in range(4, 9):
        made.pipeline._enqueue(pair(STAMP + i * 33 * MS))
    made.pipeline._each_second(Stream())
    late = "the transform from 'camera' to 'base_link' arrives 0.35 s after the frames"
    assert late in made.status.message
    assert made.log[-1][1].startswith(late)
    totals = made.snapshot.totals
    assert (totals[Count.DROPPED_UNDER_LOAD], totals[Count.DROPPED_WHILE_WAITING]) == (3, 5)


def test_a_guess_that_is_not_known_is_reported(make):
    made = make(guess_frame_id='wheels', wait_for_transform=0.0)
    for second in range(3):
        made.robot._guess.T_guess_base(STAMP + second * 1000 * MS)
    made.pipeline._each_second(Stream())
    unknown = "the transform from 'base_link' to 'wheels' (guess_frame_id) has never been known"
    assert unknown in made.status.message
    assert made.log[-1][1].startswith(unknown)


@pytest.mark.parametrize('cores', [1, 2])
@pytest.mark.parametrize('where', ['frame', 'register'])
def test_waits_for_transforms_are_no_work(make, monkeypatch, cores, where):
    made = make(cores=cores)
    transforms = made.pipeline._transforms

    def wait(*arguments, **options):
        transforms._waited_in_vain = False
        transforms.find('base_link', 'nowhere', STAMP, 0.3)
        raise InputError('it is not known')
    part = made.pipeline._assembler if where == 'frame' else made.camera
    monkeypatch.setattr(made.pipeline._assembler, 'missing_for', lambda pair: '')
    monkeypatch.setattr(part, where, wait)
    made.pipeline.start()
    made.pipeline._enqueue(pair(STAMP))
    made.graph.wait_until(lambda: made.snapshot.totals[Count.DAMAGED], 'the frame')
    made.pipeline.close()
    assert transforms.waited_in_all >= 0.3
    assert max(made.pipeline._worker.busy) < 0.25


@pytest.mark.parametrize('request_it', [
    lambda requests: requests._reset(None),
    lambda requests: requests._set_pose(PoseWithCovariance.identity(), False)])
def test_where_the_base_is_placed_anew_tf_of_the_guess_is_forgotten(
        make, monkeypatch, request_it):
    made = make(guess_frame_id='wheels', wait_for_transform=0.0, publish_tf=True,
                initial_pose=(0.0,) * 6)
    monkeypatch.setattr(made.robot._guess, 'T_guess_base',
                        lambda stamp: np.eye(4) if stamp == STAMP else None)
    sent = []
    monkeypatch.setattr(made.outputs._publisher._tf, 'send',
                        lambda stamp, *_: sent.append((stamp - STAMP) // MS))
    made.see(STAMP, STAMP + 33 * MS)
    request_it(made.pipeline._requests)
    made.work()
    made.robot._start.cancel()
    made.see(STAMP + 66 * MS)
    assert sent == [0, 33]
