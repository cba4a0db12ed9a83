# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Transforms as other nodes publish them: fixed and moving ones, also over DDS."""

import threading
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.ros.conversions import transform_stamped
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.transforms import Transforms
from aick_ros.settings.node import NodeSettings

tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SECOND = 10 ** 9
IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def pose(seed):
    return se3.exp(np.random.default_rng(seed).normal(0, 1, 6))


class Robot:
    """A node with extrinsics, and another one that publishes the frames of the robot."""

    def __init__(self, wait_until):
        self.wait_until = wait_until
        self.node, self.other = rclpy.create_node('probe'), rclpy.create_node('robot')
        self._publishers = {
            '/tf_static': self.other.create_publisher(tf2_msgs.TFMessage, '/tf_static', LATCHED),
            '/tf': self.other.create_publisher(tf2_msgs.TFMessage, '/tf', 100)}
        self.heard = 0
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def extrinsics(self, **settings):
        transforms = Transforms(self.node, ('odom', 'base_link'), self._count)
        self.node.create_timer(0.05, transforms.tend)
        return Extrinsics(transforms, NodeSettings(**settings))

    def publish(self, links, topic='/tf_static', stamp=0):
        """Publish {(parent, child): T_parent_child} and wait until it is heard."""
        before = self.heard
        self._publishers[topic].publish(tf2_msgs.TFMessage(transforms=[
            transform_stamped(stamp, *frames, T) for frames, T in links.items()]))
        self.wait_until(lambda: self.heard > before, f'{topic} to be heard')

    def listeners(self, topic='/tf'):
        return self._publishers[topic].get_subscription_count()

    def close(self):
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()
        self.other.destroy_node()

    def _count(self):
        self.heard += 1


class Heard:
    """Transforms on a node; ``changes`` counts the calls of ``on_change``."""

    def __init__(self, node, tell_tf, own=('odom', 'base_link')):
        self.node, self.hear, self.changes = node, tell_tf, 0
        self.transforms = Transforms(node, own, self._count)
        self.tend = self.transforms.tend

    def find(self, *arguments, **options):
        found = self.transforms.find(*arguments, **options)
        return None if found is None else found.T_target_source

    def topics(self):
        return [subscription.topic_name for subscription in self.node.subscriptions]

    def listen(self, *frames):
        """Have it subscribe to /tf."""
        assert self.find(*frames, 0) is None
        self.tend()

    def _count(self):
        self.changes += 1


@pytest.fixture
def heard(node, tell_tf):
    return Heard(node, tell_tf)


@pytest.mark.parametrize('own', [('odom', 'base_link'), ('/odom', '/base_link')])
def test_the_link_that_this_node_publishes_is_not_heard(node, tell_tf, own):
    """Whoever writes a slash: it would follow itself. Others of either frame are heard."""
    heard = Heard(node, tell_tf, own)
    heard.listen('odom', 'base_link')
    for names in (('odom', 'base_link'), ('/odom', '/base_link')):
        heard.hear({names: pose(1)}, '/tf', SECOND)
    assert heard.find('odom', 'base_link', SECOND) is None
    heard.hear({('odom', 'mast'): pose(2), ('torso', 'base_link'): pose(3)}, '/tf', SECOND)
    np.testing.assert_allclose(heard.find('odom', 'mast', SECOND), pose(2), atol=1e-12)
    np.testing.assert_allclose(heard.find('torso', 'base_link', SECOND), pose(3), atol=1e-12)


def test_fixed_links_are_subscribed_to_also_those_published_before(heard):
    [subscription] = heard.node.subscriptions
    assert (subscription.msg_type, subscription.topic_name) == (tf2_msgs.TFMessage, '/tf_static')
    assert subscription.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert subscription.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    assert subscription.qos_profile.depth >= 100


def test_every_message_is_a_change(heard):
    heard.hear({('base_link', 'camera'): pose(1)})
    assert heard.changes == 1
    heard.listen('base_link', 'head')
    heard.hear({('base_link', 'head'): pose(1)}, '/tf')
    assert heard.changes == 2


def test_tf_is_subscribed_to_only_while_fixed_links_do_not_suffice(heard):
    heard.tend()
    assert heard.topics() == ['/tf_static']  # nothing was requested
    heard.hear({('base_link', 'camera'): pose(1)})
    assert heard.find('base_link', 'camera', 0) is not None
    heard.tend()
    assert heard.topics() == ['/tf_static']
    heard.listen('base_link', 'head')
    heard.tend()
    assert heard.topics() == ['/tf_static', '/tf']
    *_, moving = heard.node.subscriptions
    assert moving.qos_profile.depth >= 100
    heard.hear({('base_link', 'head'): pose(2)}, '/tf', SECOND)
    np.testing.assert_allclose(heard.find('base_link', 'head', SECOND), pose(2), atol=1e-12)
    heard.tend()
    assert '/tf' in heard.topics()  # it moves
    heard.hear({('base_link', 'head'): pose(3)})
    np.testing.assert_allclose(heard.find('base_link', 'head', SECOND), pose(3), atol=1e-12)
    heard.tend()
    heard.tend()
    assert heard.topics() == ['/tf_static']


def test_what_moved_before_tf_was_unsubscribed_is_forgotten(heard):
    """It is too old by the time when /tf is subscribed to again, and may be another one."""
    heard.listen('base_link', 'head')
    heard.hear({('base_link', 'head'): pose(1), ('base_link', 'arm'): pose(2)}, '/tf', SECOND)
    heard.hear({('base_link', 'head'): pose(3)})
    assert heard.find('base_link', 'head', SECOND) is not None
    heard.tend()
    assert heard.find('base_link', 'arm', SECOND) is None


def test_a_transform_of_fixed_links_alone_is_fixed_until_one_above_moves(heard):
    def is_fixed(source):
        return heard.transforms.find('base_link', source, SECOND).is_static
    heard.hear({('base_link', 'head'): pose(1), ('head', 'camera'): pose(2)})
    for _ in range(2):  # looked up, and known
        assert is_fixed('camera') and is_fixed('/camera')
    heard.listen('base_link', 'arm')
    heard.hear({('base_link', 'arm'): pose(1)}, '/tf', SECOND)
    heard.hear({('arm', 'camera'): pose(2)})
    assert is_fixed('head') and not is_fixed('arm') and not is_fixed('camera')


def turn(heard, rate, *seconds):
    """Hear a head that turns at a rate [rad/s], from 100 s on."""
    heard.listen('base_link', 'head')
    for second in seconds:
        heard.hear({('base_link', 'head'): se3.exp([0, 0, 0, 0, 0, rate * second])}, '/tf',
                   100 * SECOND + round(second * SECOND))


def rejected(gap):
    return pytest.raises(InputError, match=(
        "^the transform from 'head' to 'base_link' moves, and the nearest one is "
        f'{gap:.3f} s from the image stamp: check that the clocks agree and that /tf is still '
        'published, or raise wait_for_transform$'))


@pytest.mark.parametrize('gap', [0.005, 0.05, 0.45])
def test_a_head_that_turns_is_not_where_its_last_sample_is(heard, gap):
    """At 1 rad/s it would be off by 26 degrees after 0.45 s."""
    turn(heard, 1.0, *np.arange(0.0, 1.005, 0.01))
    with rejected(gap):
        heard.find('base_link', 'head', 101 * SECOND + round(gap * SECOND))
    found = heard.find('base_link', 'head', 100 * SECOND + 555 * SECOND // 1000)
    np.testing.assert_allclose(found, se3.exp([0, 0, 0, 0, 0, 0.555]), atol=1e-9)


@pytest.mark.parametrize('period', [0.01, 0.1, 1.0])
def test_a_head_at_rest_is_where_its_last_sample_is_for_half_a_second(heard, period):
    """As a fixed joint that is published on /tf, also at 1 Hz."""
    turn(heard, 0.0, *np.arange(0.0, 2.005, period))
    for gap in (0.01, 0.5):
        found = heard.find('base_link', 'head', 102 * SECOND + round(gap * SECOND))
        np.testing.assert_array_equal(found, np.eye(4))
    with rejected(0.5):
        heard.find('base_link', 'head', 102 * SECOND + SECOND // 2 + 1)


def test_a_head_that_has_just_stopped_must_rest_as_long_as_it_is_extrapolated(heard):
    turn(heard, 1.0, 0.0, 0.1, 0.2)
    for tenths in (3, 4, 5):
        heard.hear({('base_link', 'head'): se3.exp([0, 0, 0, 0, 0, 0.2])}, '/tf',
                   100 * SECOND + tenths * SECOND // 10)
    heard.find('base_link', 'head', 100 * SECOND + 8 * SECOND // 10)
    with rejected(0.301):
        heard.find('base_link', 'head', 100 * SECOND + 801 * SECOND // 1000)


def test_of_a_single_sample_it_is_not_known_whether_it_rests(heard):
    turn(heard, 0.0, 0.0)
    np.testing.assert_array_equal(heard.find('base_link', 'head', 100 * SECOND), np.eye(4))
    with rejected(0.015):
        heard.find('base_link', 'head', 100 * SECOND + 15 * SECOND // 1000)


@pytest.mark.parametrize('largest_gap', [None, SECOND])
def test_an_image_before_the_first_sample_is_never_answered_nor_waited_for(heard, largest_gap):
    """As the first frame, whose request is why /tf is subscribed to: its pose stays for good."""
    turn(heard, 0.0, 0.0, 0.1, 0.2)
    with rejected(0.015), counted_wait(heard) as asked:
        heard.find('base_link', 'head', 100 * SECOND - 15 * SECOND // 1000, 60.0, largest_gap)
    assert asked == []


@pytest.mark.parametrize('largest_gap', [None, SECOND // 2])
@pytest.mark.parametrize('after, gap', [(0.1, 0.1), (1.6, 1.4), (2.9, 0.1)])
def test_an_image_in_a_hole_of_the_samples_is_never_answered_nor_waited_for(
        heard, after, gap, largest_gap):
    """Wherever the link has been meanwhile: only samples at most 0.5 s apart are interpolated."""
    turn(heard, 0.2, 0.0, 3.0)
    with rejected(gap), counted_wait(heard) as asked:
        heard.find('base_link', 'head', 100 * SECOND + round(after * SECOND), 60.0, largest_gap)
    assert asked == []
    heard.find('base_link', 'head', 103 * SECOND, 60.0, largest_gap)


@pytest.mark.parametrize('gap, is_waited_for', [(0.59, True), (0.61, False)])
def test_a_link_that_has_stopped_is_not_waited_for(heard, gap, is_waited_for):
    """Frames must not wait for wheels that were switched off."""
    turn(heard, 0.0, 0.0, 1.0)
    with rejected(gap), counted_wait(heard) as asked:
        heard.find('base_link', 'head', 101 * SECOND + round(gap * SECOND), 0.1)
    assert asked == [0.1] * is_waited_for


@pytest.mark.parametrize('gap, is_found', [(5, True), (6, False)])
def test_samples_of_a_moving_link_may_have_to_be_nearer(heard, gap, is_found):
    heard.listen('base_link', 'head')
    heard.hear({('base_link', 'head'): pose(1)}, '/tf', 100 * SECOND)
    if is_found:
        found = heard.find('base_link', 'head', 100 * SECOND + gap, largest_gap=5)
        np.testing.assert_allclose(found, pose(1), atol=1e-12)
    else:
        with rejected(0.0):
            heard.find('base_link', 'head', 100 * SECOND + gap, largest_gap=5)


@pytest.mark.parametrize('topic', ['/tf_static', '/tf'])
def test_a_damaged_link_does_not_keep_the_others_from_being_heard(heard, log, topic):
    heard.listen('base_link', 'camera')
    nowhere = np.eye(4)
    nowhere[0, 3] = np.nan
    for _ in range(2):
        heard.hear({('base_link', 'arm'): nowhere, ('base_link', 'camera'): pose(1)}, topic,
                   SECOND)
    np.testing.assert_allclose(heard.find('base_link', 'camera', SECOND), pose(1), atol=1e-12)
    [text] = log.warnings
    assert text.startswith("the transform from 'base_link' to 'arm' is ignored: ")
    assert text.endswith('; check its publisher')
    assert min(log.throttles) >= 1.0


def test_images_of_ever_new_frames_do_not_fill_the_memory(heard):
    for i in range(1000):
        heard.find('base_link', f'camera_{i}', 0)
    assert len(heard.transforms._moving) < 100


@pytest.mark.parametrize('topic, stamp', [('/tf', 3 * SECOND // 2), ('/tf_static', 0)])
def test_who_waits_is_woken_by_what_he_waits_for(heard, topic, stamp):
    """And not by less: a moving link must have reached the stamp."""
    heard.listen('base_link', 'camera')
    with ThreadPoolExecutor(1) as thread:
        found = thread.submit(heard.find, 'base_link', 'camera', 3 * SECOND // 2, 60.0)
        heard.hear({('base_link', 'camera'): pose(1)}, '/tf', SECOND)
        assert not wait([found], 0.1).done
        heard.hear({('base_link', 'camera'): pose(2)}, topic, stamp)
        np.testing.assert_allclose(found.result(30.0), pose(2), atol=1e-12)


@contextmanager
def counted_wait(heard):
    """Record the longest times of waits, none of which takes any."""
    asked, condition = [], heard.transforms._changed

    class Watched:
        def __enter__(self):
            return condition.__enter__()

        def __exit__(self, *error):
            return condition.__exit__(*error)

        def wait_for(self, reached, longest):
            asked.append(longest)
            return condition.wait_for(reached, 0.0)

    heard.transforms._changed = Watched()
    try:
        yield asked
    finally:
        heard.transforms._changed = condition


def waits(heard, *frames):
    """Return whether frames are waited for."""
    with counted_wait(heard) as asked:
        try:
            heard.find(*frames, SECOND, 0.1)
        except InputError:
            pass
    return asked == [0.1]


def test_the_time_of_waits_is_that_of_the_thread_that_waits(heard):
    turn(heard, 0.0, 0.0, 1.0)
    with ThreadPoolExecutor(1) as thread:
        def wait_in_vain():
            heard.find('base_link', 'head', 101 * SECOND + SECOND // 4, 0.1)
            return heard.transforms.waited()
        there = thread.submit(wait_in_vain).result(30.0)
    assert 0.1 <= there < 5.0
    assert heard.transforms.waited() < 0.1
    assert there <= heard.transforms.waited_in_all < there + 0.1


def test_transforms_that_arrive_late_are_complained_about_with_their_time(heard):
    """0.35 s after the images, of which frames wait for 0.02 s each."""
    turn(heard, 0.0, 0.0, 1.0)
    for i in range(3):
        assert heard.transforms.complaint == ''
        heard.find('base_link', 'head', 101 * SECOND + 33 * SECOND // 100, 0.02)
    assert heard.transforms.complaint.startswith(
        "the transform from 'head' to 'base_link' arrives 0.35 s after the frames that need it")


def test_what_is_in_time_or_not_waited_for_is_not_late(heard):
    turn(heard, 0.0, 0.0, 1.0)
    for _ in range(10):
        heard.find('base_link', 'head', 101 * SECOND, 0.02)
        heard.find('base_link', 'head', 101 * SECOND + SECOND // 3)
        with rejected(5.0):
            heard.find('base_link', 'head', 106 * SECOND, 0.02)
        with rejected(0.3):
            heard.find('base_link', 'head', 99 * SECOND + 7 * SECOND // 10, 0.02)
    assert heard.transforms.complaint == ''


def test_unknown_frames_are_waited_for_once_until_there_is_a_new_link(heard):
    """Many images of them, of one frame or of ever new ones, do not hold up the good ones."""
    base, link = 'base_link', {('base_link', 'arm'): pose(1)}
    heard.listen(base, 'camera')
    assert waits(heard, base, 'unknown')
    assert not any(waits(heard, base, f'unknown_{i % 7}') for i in range(150))
    heard.hear(link, '/tf', SECOND // 2)
    assert waits(heard, base, 'arm')  # connected, but the stamp is not reached
    assert waits(heard, base, 'unknown')  # the link was new
    heard.hear(link, '/tf', 3 * SECOND // 4)  # and is no longer
    assert not waits(heard, base, 'unknown')
    heard.hear({('arm', 'hand'): pose(2)}, '/tf_static')
    assert waits(heard, base, 'unknown')
    heard.hear({('arm', 'hand'): pose(2)}, '/tf_static')
    assert not waits(heard, base, 'unknown')


# Over DDS.

@pytest.fixture
def robot(ros, wait_until):
    robot = Robot(wait_until)
    yield robot
    robot.close()


def test_down_a_chain_and_up_another(robot):
    extrinsics = robot.extrinsics()
    robot.publish({('map', 'base_link'): pose(1), ('map', 'mast'): pose(2),
                   ('mast', 'head'): pose(3), ('head', 'camera'): pose(4)})
    T_map_camera = pose(2) @ pose(3) @ pose(4)
    np.testing.assert_allclose(extrinsics.camera_in_base('camera', 0).T_base_camera,
                               np.linalg.inv(pose(1)) @ T_map_camera, atol=1e-9)


def test_the_parameters_go_first(robot):
    extrinsics = robot.extrinsics(camera_in_base=(1.0, *IDENTITY[1:]),
                                  depth_in_colour=(0.0, 2.0, *IDENTITY[2:]))
    T = extrinsics.camera_in_base('camera', 0).T_base_camera
    np.testing.assert_array_equal(T[:3, 3], (1, 0, 0))
    np.testing.assert_array_equal(extrinsics.depth_in_colour('camera', 'depth', 0)[:3, 3],
                                  (0, 2, 0))


@pytest.mark.parametrize('name', ['camera_in_base', 'depth_in_colour'])
def test_a_parameter_that_is_no_pose_is_rejected(robot, name):
    with pytest.raises(InputError, match=f'{name} = .* is no pose: x y z qx qy qz qw are'):
        robot.extrinsics(**{name: (1.0, 2.0, 3.0)})


def test_a_leading_slash_of_old_drivers_does_not_matter(robot):
    extrinsics = robot.extrinsics()
    robot.publish({('base_link', '/camera'): pose(1)})
    for frame in ('camera', '/camera'):
        np.testing.assert_allclose(
            extrinsics.camera_in_base(frame, 0).T_base_camera, pose(1), atol=1e-9)


def test_the_base_itself_needs_no_transform(robot):
    T = robot.extrinsics().camera_in_base('base_link', 0).T_base_camera
    np.testing.assert_array_equal(T, np.eye(4))


def test_without_a_transform_one_sentence_names_both_frames(robot):
    extrinsics = robot.extrinsics(wait_for_transform=0.0)
    with pytest.raises(InputError, match=r"no transform from 'camera' \(the colour image\) to "
                                         r"'base_link' \(frame_id\) yet"):
        extrinsics.camera_in_base('camera', 0)
    with pytest.raises(InputError, match=r"from 'ir' \(the depth image\) to 'camera' \(the "
                                         r"colour image\) yet: .*, or set depth_in_colour"):
        extrinsics.depth_in_colour('camera', 'ir', 0)


def test_a_fixed_transform_sent_again_counts(robot):
    extrinsics = robot.extrinsics()
    robot.publish({('base_link', 'camera'): pose(1)})
    np.testing.assert_allclose(
        extrinsics.camera_in_base('camera', 0).T_base_camera, pose(1), atol=1e-9)
    robot.publish({('base_link', 'camera'): pose(2)})
    np.testing.assert_allclose(
        extrinsics.camera_in_base('camera', 0).T_base_camera, pose(2), atol=1e-9)


@pytest.mark.parametrize('metres', [1e12, 1e300])
def test_an_absurd_transform_is_ignored_with_a_sentence(robot, capfd, metres):
    extrinsics = robot.extrinsics()
    absurd = np.eye(4)
    absurd[0, 3] = metres
    robot.publish({('base_link', 'camera'): absurd})
    with pytest.raises(InputError, match='no transform from'):
        extrinsics.camera_in_base('camera', 0, wait=False)
    assert ("[probe]: the transform from 'base_link' to 'camera' is ignored: "
            in capfd.readouterr().err)
    robot.publish({('base_link', 'camera'): pose(2)})
    np.testing.assert_allclose(
        extrinsics.camera_in_base('camera', 0).T_base_camera, pose(2), atol=1e-9)


def ask_for_the_camera(robot, extrinsics):
    """Request what fixed links do not give, so that the node subscribes to /tf."""
    with pytest.raises(InputError):
        extrinsics.camera_in_base('camera', 0, wait=False)
    robot.wait_until(robot.listeners, 'who listens')


def test_a_moving_transform_is_taken_at_the_stamp(robot):
    extrinsics = robot.extrinsics(wait_for_transform=0.0)
    robot.publish({('head', 'camera'): pose(1)})
    ask_for_the_camera(robot, extrinsics)
    for i in range(4):
        robot.publish({('base_link', 'head'): se3.exp([0, 0, 0, 0, 0, 0.1 * i])}, '/tf',
                      100 * SECOND + i * SECOND // 10)
    T_base_head = se3.exp([0, 0, 0, 0, 0, 0.15])
    np.testing.assert_allclose(
        extrinsics.camera_in_base('camera', 100 * SECOND + 15 * SECOND // 100).T_base_camera,
        T_base_head @ pose(1), atol=1e-9)


def test_a_frame_waits_for_the_moving_transform_of_its_stamp(robot):
    """Not on the executor's thread: there nothing would come while it waits."""
    extrinsics = robot.extrinsics(wait_for_transform=8.0)
    ask_for_the_camera(robot, extrinsics)
    robot.publish({('base_link', 'camera'): pose(1)}, '/tf', 100 * SECOND)
    later = threading.Timer(0.3, robot.publish, (
        {('base_link', 'camera'): pose(2)}, '/tf', 101 * SECOND))
    later.start()
    np.testing.assert_allclose(
        extrinsics.camera_in_base('camera', 101 * SECOND).T_base_camera, pose(2), atol=1e-9)
    later.join()


def test_a_moving_transform_long_ago_is_rejected(robot):
    extrinsics = robot.extrinsics(wait_for_transform=0.0)
    ask_for_the_camera(robot, extrinsics)
    robot.publish({('base_link', 'camera'): pose(1)}, '/tf', 100 * SECOND)
    robot.publish({('base_link', 'camera'): pose(1)}, '/tf', 100 * SECOND + SECOND // 4)
    extrinsics.camera_in_base('camera', 100 * SECOND + SECOND // 2)
    with pytest.raises(InputError, match='the nearest one is 2.750 s from the image stamp'):
        extrinsics.camera_in_base('camera', 103 * SECOND)


def test_the_odometry_itself_does_not_place_the_camera(robot):
    """A camera fixed in the room must not be placed by base_link -> odom -> room."""
    extrinsics = robot.extrinsics(wait_for_transform=0.0)
    robot.publish({('odom', 'camera'): pose(1)})
    ask_for_the_camera(robot, extrinsics)
    robot.publish({('odom', 'base_link'): pose(2)}, '/tf', 100 * SECOND)
    with pytest.raises(InputError, match="no transform from 'camera'"):
        extrinsics.camera_in_base('camera', 100 * SECOND)


def test_tf_is_unsubscribed_once_fixed_transforms_suffice(robot):
    extrinsics = robot.extrinsics()
    ask_for_the_camera(robot, extrinsics)
    robot.publish({('base_link', 'camera'): pose(1)})
    extrinsics.camera_in_base('camera', 0)
    robot.wait_until(lambda: not robot.listeners(), 'nobody to listen')
