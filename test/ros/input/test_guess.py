# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The wheels carry the pose through the dark: over DDS, with wheels that know the truth."""


import numpy as np
import pytest
from std_srvs.srv import Empty

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.frame_tree import FrameTransform
from aick_ros.odometry.base_odometry import Mount
from aick_ros.ros.conversions import from_pose, from_transform, to_stamp, transform_stamped
from aick_ros.ros.input.extrinsics import Extrinsic
from aick_ros.ros.input.guess import Guess, StartByGuess
from aick_ros.settings.node import NodeSettings

T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
T_WHEELS_START = se3.exp([2.0, -1.0, 0.0, 0.0, 0.0, 0.7])  # they count from elsewhere
COUNT, DARK = 24, range(6, 18)
LOST = 9999.0


@pytest.fixture(scope='module')
def recording(source, all_frames, darken):
    """Frames with a stretch in the dark, and where the base was by the truth."""
    T_camera0_world = se3.inverse(source.ground_truth.poses[0])
    truth = [T_BASE_CAMERA @ T_camera0_world @ pose @ se3.inverse(T_BASE_CAMERA)
             for pose in source.ground_truth.poses[:COUNT]]
    return [darken(frame) if i in DARK else frame
            for i, frame in enumerate(all_frames[:COUNT])], truth


def play(rig, frames, truth, wheels):
    """Publish frames, each after the wheels' transform of its stamp; return the answers."""
    rig.send_camera_info(frames[0].camera)
    for frame, pose in zip(frames, truth):
        wheels(frame.stamp, T_WHEELS_START @ pose)
        rig.send(frame)
        rig.answer(frame.stamp)
    return [rig.answer(frame.stamp) for frame in frames]


@pytest.fixture
def wheels(rig):
    """Publish wheel_odom -> base_link on /tf, which is heard by the time this is used."""
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    publisher = rig.node.create_publisher(tf2_msgs.TFMessage, '/tf', 100)

    def publish(stamp, T):
        rig.wait_until(publisher.get_subscription_count, 'the node to listen to /tf')
        publisher.publish(tf2_msgs.TFMessage(transforms=[
            transform_stamped(stamp, 'wheel_odom', 'base_link', T)]))

    return publish


def test_the_wheels_bridge_a_loss(rig, start_node, recording, wheels):
    frames, truth = recording
    start_node(frame_id='base_link', guess_frame_id='wheel_odom', publish_tf='true',
               wait_for_transform=1.0, camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    answers = play(rig, frames, truth, wheels)
    for i, answer in enumerate(answers):
        error = se3.inverse(T_WHEELS_START @ truth[i]) @ from_pose(answer.pose.pose)
        assert np.linalg.norm(error[:3, 3]) < 0.04, i
        # only what the camera measured has a covariance, and not the first frame after a loss
        assert (answer.pose.covariance[0] == LOST) == (i in DARK or i == DARK.stop)
    moved = se3.inverse(truth[DARK.start]) @ truth[DARK.stop]
    assert np.linalg.norm(moved[:3, 3]) > 0.08  # it would have been missed by more


def test_tf_is_that_of_the_guess_frame_and_goes_on(rig, start_node, recording, wheels):
    """base_link has a parent already: ours is that of wheel_odom, and both agree."""
    frames, truth = recording
    rig.listen_to_tf()
    start_node(frame_id='base_link', guess_frame_id='wheel_odom', wait_for_transform=1.0,
               camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    answers = play(rig, frames, truth, wheels)
    rig.wait_until(lambda: sum(link.header.frame_id == 'odom' for link in rig.links) == COUNT,
                   'the transforms')
    links = {to_stamp(link.header.stamp): link for link in rig.links
             if link.header.frame_id == 'odom'}
    assert {link.child_frame_id for link in links.values()} == {'wheel_odom'}
    for frame, answer, pose in zip(frames, answers, truth):
        T_odom_base = from_transform(links[frame.stamp].transform) @ T_WHEELS_START @ pose
        np.testing.assert_allclose(T_odom_base, from_pose(answer.pose.pose), atol=1e-6)


def test_without_wheels_the_pose_is_held(rig, start_node, recording):
    frames, _ = recording
    start_node(frame_id='base_link', guess_frame_id='wheel_odom', initial_pose='0 0 0 0 0 0',
               camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    answers = play(rig, frames[:8], 8 * [np.eye(4)], lambda stamp, T: None)
    held, lost = (from_pose(answers[i].pose.pose) for i in (DARK.start - 1, DARK.start))
    np.testing.assert_array_equal(lost, held)


def test_both_odometries_start_in_one_frame(rig, start_node, recording, wheels):
    """At the first frame, and again after a reset."""
    frames, truth = recording
    start_node(frame_id='base_link', guess_frame_id='wheel_odom', wait_for_transform=1.0,
               camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    first = play(rig, frames[:2], truth, wheels)[0]
    np.testing.assert_allclose(from_pose(first.pose.pose), T_WHEELS_START @ truth[0], atol=1e-9)
    rig.call(Empty, '/odom_node/reset_odom')
    again = play(rig, frames[2:4], truth[2:], wheels)[0]
    np.testing.assert_allclose(from_pose(again.pose.pose), T_WHEELS_START @ truth[2], atol=1e-9)


def test_an_initial_pose_takes_precedence(rig, start_node, recording, wheels):
    frames, truth = recording
    start_node(frame_id='base_link', guess_frame_id='wheel_odom', initial_pose='1 0 0 0 0 0',
               camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')
    answer = play(rig, frames[:1], truth, wheels)[0]
    np.testing.assert_allclose(from_pose(answer.pose.pose), se3.exp([1, 0, 0, 0, 0, 0]), atol=1e-9)


class Wheels:
    """Transforms of a test's own making; ``T`` is an error where they are too old."""

    def __init__(self, T):
        self.T, self.waits = T, []

    def find(self, target, source, stamp, wait=0.0, largest_gap=0):
        assert (target, source) == ('wheel_odom', 'base_link')
        assert largest_gap == 5_000_000  # the last sample of wheels that lag is not where they are
        self.waits.append(wait)
        if isinstance(self.T, Exception):
            raise self.T
        return None if self.T is None else FrameTransform(self.T(stamp))


class Head:
    """A camera on a head that turns by 0.2 rad per nanosecond, or is not known."""

    T_neck_camera = se3.exp([0.1, 0.0, 0.3, 0.4, -0.2, 0.1])

    def __init__(self):
        self.error = None

    def camera_in_base(self, camera_frame, stamp, wait=True):
        assert camera_frame == 'camera'
        if self.error is not None:
            raise self.error
        return Extrinsic(se3.exp([0, 0, 1.0, 0, 0, 0.2 * stamp]) @ self.T_neck_camera,
                         Mount.MOVING)


def guess_by(T, extrinsics=None):
    wheels = Wheels(T)
    return Guess(wheels, extrinsics, NodeSettings(guess_frame_id='wheel_odom')), wheels


def drive(stamp):
    return T_WHEELS_START @ se3.exp([0.3 * stamp, 0, 0, 0, 0, 0.1 * stamp])


def start_by(T):
    guess, wheels = guess_by(T)
    return StartByGuess(guess, NodeSettings(guess_frame_id='wheel_odom')), wheels


def test_the_start_waits_for_the_wheels():
    start, wheels = start_by(None)
    for stamp in (10 ** 9, 2 * 10 ** 9):
        with pytest.raises(InputError, match="guess_frame_id = 'wheel_odom', which is not known"):
            start.pose(stamp)
    wheels.T = lambda stamp: T_WHEELS_START
    np.testing.assert_array_equal(start.pose(3 * 10 ** 9).matrix, T_WHEELS_START)


def test_the_start_is_that_of_each_frame_until_one_is_tracked():
    start, _ = start_by(drive)
    for stamp in (3, 5):
        np.testing.assert_array_equal(start.pose(stamp).matrix, drive(stamp))
    start.cancel()
    assert start.pose(7) is None


def test_the_start_does_not_wait_for_ever():
    start, wheels = start_by(None)
    with pytest.raises(InputError):
        start.pose(10 ** 9)
    assert start.pose(6 * 10 ** 9) is None
    wheels.T = lambda stamp: T_WHEELS_START
    assert start.pose(7 * 10 ** 9) is None  # the pose must not jump


def test_the_wheels_are_waited_for_five_seconds_of_stamps():
    start, _ = start_by(None)
    for stamp in (10 ** 9, 6 * 10 ** 9 - 1):
        with pytest.raises(InputError):
            start.pose(stamp)
    assert start.pose(6 * 10 ** 9) is None


def test_a_recording_that_loops_waits_anew():
    start, _ = start_by(None)
    for stamp in (10 ** 9, 5 * 10 ** 9, 10 ** 8, 51 * 10 ** 8 - 1):
        with pytest.raises(InputError):
            start.pose(stamp)
    assert start.pose(51 * 10 ** 8) is None


def test_after_a_reset_the_start_is_looked_for_and_waited_for_anew():
    start, wheels = start_by(None)
    with pytest.raises(InputError):
        start.pose(10 ** 9)
    assert start.pose(6 * 10 ** 9) is None
    start.reset()
    with pytest.raises(InputError):
        start.pose(7 * 10 ** 9)
    wheels.T = drive
    np.testing.assert_array_equal(start.pose(8).matrix, drive(8))
    start.cancel()
    start.reset()
    np.testing.assert_array_equal(start.pose(10).matrix, drive(10))


def test_what_is_missing_at_the_start_is_said_in_a_sentence():
    start, _ = start_by(None)
    with pytest.raises(InputError, match=(
            "^the odometry starts at the pose in guess_frame_id = 'wheel_odom', which is not "
            'known yet: publish it on /tf, or set initial_pose$')):
        start.pose(1)


@pytest.mark.parametrize('guess, initial', [(True, (0.0,) * 6), (False, ())])
def test_with_an_initial_pose_or_without_a_guess_it_starts_where_it_is(guess, initial):
    guess, wheels = guess_by(lambda stamp: T_WHEELS_START) if guess else (None, None)
    start = StartByGuess(guess, NodeSettings(initial_pose=initial))
    assert start.pose(1) is None
    start.reset()
    assert start.pose(2) is None


def test_tf_is_listened_to_from_the_start_without_waiting():
    _, wheels = guess_by(None)
    assert wheels.waits == [0.0]


def test_a_moving_camera_is_not_waited_for_in_the_past():
    asked = []

    class Recording(Head):
        def camera_in_base(self, camera_frame, stamp, wait=True):
            asked.append((stamp, wait))
            return super().camera_in_base(camera_frame, stamp, wait)
    guess, _ = guess_by(drive, Recording())
    assert guess.camera_motion('camera', 3, 5) is not None
    assert asked == [(3, False), (5, True)]


@pytest.mark.parametrize('known', [3, 5])
def test_a_motion_needs_both_of_its_ends(known):
    guess, _ = guess_by(lambda stamp: drive(stamp) if stamp == known else None)
    assert guess.base_motion(3, 5) is None
    assert guess.camera_motion('camera', 3, 5) is None


def test_a_pose_that_was_set_is_the_start():
    start, _ = start_by(lambda stamp: T_WHEELS_START)
    start.cancel()
    assert start.pose(10 ** 9) is None


def test_the_motion_of_the_base_is_that_between_the_stamps():
    guess, _ = guess_by(lambda stamp: T_WHEELS_START @ se3.exp([stamp, 0, 0, 0, 0, 0]))
    np.testing.assert_allclose(guess.base_motion(3, 5), se3.exp([2, 0, 0, 0, 0, 0]), atol=1e-12)


def test_the_turn_of_a_head_is_a_motion_of_its_camera():
    """Seen from the world, T_world_camera = T_world_base @ T_base_camera at either stamp."""
    head = Head()
    guess, _ = guess_by(drive, head)
    T_world_camera3, T_world_camera5 = (
        drive(stamp) @ head.camera_in_base('camera', stamp).T_base_camera for stamp in (3, 5))
    np.testing.assert_allclose(T_world_camera3 @ guess.camera_motion('camera', 3, 5),
                               T_world_camera5, atol=1e-12)


def test_the_turn_of_a_head_during_a_loss_does_not_move_the_base():
    """The wheels stand still; the base is found again by the extrinsic at each stamp."""
    head = Head()
    guess, _ = guess_by(lambda stamp: T_WHEELS_START, head)
    before, now = (head.camera_in_base('camera', stamp).T_base_camera for stamp in (3, 5))
    T_base3_base5 = before @ guess.camera_motion('camera', 3, 5) @ se3.inverse(now)
    np.testing.assert_allclose(T_base3_base5, np.eye(4), atol=1e-12)


def test_without_the_extrinsic_there_is_no_motion_of_the_camera():
    head = Head()
    guess, _ = guess_by(drive, head)
    head.error = InputError('the transform is too old')
    assert guess.camera_motion('camera', 3, 5) is None


@pytest.mark.parametrize('T', [None, InputError('too old')])
def test_silent_wheels_are_not_waited_for_again(T):
    guess, wheels = guess_by(T)
    assert guess.base_motion(3, 5) is None
    wheels.T = lambda stamp: np.eye(4)
    assert guess.base_motion(3, 5) is not None
    assert guess.base_motion(3, 5) is not None
    assert wheels.waits == [0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.0]


def test_wheels_that_stop_are_not_waited_for_though_they_are_known_of_a_keyframe():
    newest = 5
    guess, wheels = guess_by(lambda stamp: drive(stamp) if stamp <= newest else None)
    for now in (7, 9, 11):
        assert guess.base_motion(5, now) is None
    assert wheels.waits == [0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0]
    newest = 13
    assert guess.base_motion(5, 13) is not None  # in time again
    assert guess.base_motion(13, 15) is None
    assert wheels.waits[7:] == [0.0, 0.0, 0.1, 0.0]


def test_the_past_is_not_waited_for():
    """As where a keyframe is older than what is kept of /tf: no frame may be delayed by it."""
    def since_one_second(stamp):
        return None if stamp < 1_000_000_000 else drive(stamp)

    guess, wheels = guess_by(since_one_second)
    longest = NodeSettings().wait_for_transform
    guess.T_guess_base(1_500_000_000)
    wheels.waits.clear()
    for now in (2_000_000_000, 2_100_000_000):
        assert guess.base_motion(500_000_000, now) is None
    assert wheels.waits == [longest, 0.0, longest, 0.0]


class Late:
    """Wheels whose transforms come 60 ms after their stamps, and none from 3 to 3.2 s."""

    def __init__(self):
        self.waits = []

    def find(self, target, source, stamp, wait=0.0, largest_gap=0):
        self.waits.append(wait)
        is_known = wait >= 0.06 and not 3_000 * MS <= stamp <= 3_200 * MS
        return FrameTransform(np.eye(4)) if is_known else None


MS = 1_000_000


def test_wheels_that_come_late_are_waited_for_again_after_a_stall():
    """At 10 Hz, for ten times the longest wait after the one in vain."""
    wheels = Late()
    guess = Guess(wheels, None, NodeSettings(guess_frame_id='wheel_odom'))
    known = [i for i in range(100) if guess.T_guess_base(100 * MS * i) is not None]
    assert known == [*range(30), *range(40, 100)]
    assert wheels.waits[1:] == 31 * [0.1] + 9 * [0.0] + 60 * [0.1]


def test_however_long_the_wait_is_it_takes_a_tenth_of_the_time_at_most():
    wheels = Wheels(None)
    guess = Guess(wheels, None, NodeSettings(
        guess_frame_id='wheel_odom', wait_for_transform=0.5))
    for i in range(100):
        guess.T_guess_base(100 * MS * i)
    assert wheels.waits[1:] == 2 * ([0.5] + 49 * [0.0])


def test_a_recording_that_loops_waits_for_the_wheels_anew():
    guess, wheels = guess_by(None)
    for stamp in (10_000 * MS, 10_100 * MS, 500 * MS, 600 * MS):
        guess.T_guess_base(stamp)
    assert wheels.waits[1:] == [0.1, 0.0, 0.1, 0.0]


def test_wheels_that_are_not_known_are_complained_about_until_they_are():
    guess, wheels = guess_by(drive)
    seen = []
    for second in range(7):
        wheels.T = drive if second in (0, 6) else None
        guess.T_guess_base(1_000 * MS * second)
        seen.append(guess.complaint)
    assert [bool(text) for text in seen] == [False, False, False, True, True, True, False]
    assert seen[5] == (
        "the transform from 'base_link' to 'wheel_odom' (guess_frame_id) has not been known for "
        '4 s: check that it is published on /tf and that the clocks agree, or raise '
        'wait_for_transform')


def test_wheels_that_never_come_are_complained_about():
    guess, wheels = guess_by(None)
    assert guess.complaint == ''
    for second in range(3):
        guess.T_guess_base(1_000 * MS * second)
    assert guess.complaint.startswith(
        "the transform from 'base_link' to 'wheel_odom' (guess_frame_id) has never been known: ")
