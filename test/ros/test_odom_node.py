# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node: alone, then in its own process, with a camera and a consumer beside it, over DDS."""

import dataclasses
import itertools
import time
from pathlib import Path

import numpy as np
import pytest
import rclpy
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image

from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.registration.stage_times import STAGES
from aick_ros.ros import odom_node
from aick_ros.ros.arguments import Arguments
from aick_ros.ros.conversions import from_pose, from_transform, to_stamp
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset

OPTICAL = 'camera_rgb_optical_frame'
T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.1, 0.0, 0.3))
CAMERA_IN_BASE = '[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]'
LOST = 9999.0


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:12])


def offline(frames):
    odometry = Odometry()
    return {frame.stamp: odometry.register_frame(frame) for frame in frames}


def pose_of(message):
    return from_pose(message.pose.pose)


def covariance_of(block):
    return np.reshape(block.covariance, (6, 6))


def send_all(rig, frames):
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
    return [rig.answer(frame.stamp) for frame in frames]


def black(frame):
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                               depth=np.full_like(frame.depth, np.nan))


class Pipeline:
    """A pipeline that keeps what it is told to do."""

    def __init__(self, *arguments):
        self.made_of, self.done = arguments, []

    def change_settings(self, core):
        self.done.append(core)

    def __getattr__(self, name):
        return lambda: self.done.append(name)


def test_it_is_active_from_its_start_and_passes_changes_on(ros_domain, monkeypatch):
    monkeypatch.setattr(odom_node, 'Pipeline', Pipeline)
    monkeypatch.setattr(rclpy, 'spin', lambda node: node._pipeline.done.append('spin'))
    rclpy.init(args=['--ros-args', '-p', 'frame_id:=body'])
    node = odom_node.OdomNode(Arguments({'Reg/Force3DoF': 'true'}))
    pipeline = node._pipeline
    made_on, own, core = pipeline.made_of
    assert (made_on, own.frame_id, core.odometry.planar) == (node, 'body', True)
    assert pipeline.done == ['activate']
    assert node.set_parameters_atomically([Parameter('aick.alpha', value=0.5)]).successful
    assert pipeline.done.pop() == with_values(core, {'aick.alpha': 0.5})
    rejected = node.set_parameters_atomically([Parameter('frame_id', value='base')])
    assert rejected.reason == ('frame_id is read at the start only: give it to the node when it '
                               'is started, in its parameter file or with -p')
    assert node.describe_parameter('frame_id').read_only
    node.run()
    node.close()
    assert pipeline.done == ['activate', 'start', 'spin', 'close']
    rclpy.shutdown()


# Over DDS.

def test_answers_every_frame_as_offline(rig, start_node, frames):
    start_node()
    answers = send_all(rig, frames)
    expected = offline(frames)
    assert rig.stamps() == [frame.stamp for frame in frames]
    for answer in answers:
        update = expected[to_stamp(answer.header.stamp)]
        np.testing.assert_allclose(pose_of(answer), update.T_odom_camera, atol=1e-6)
        assert (answer.header.frame_id, answer.child_frame_id) == ('odom', OPTICAL)
    for odom, pose in zip(rig.odom, rig.poses):
        assert odom.header == pose.header
        assert odom.pose == pose.pose


def test_frames_velocity_and_covariance_are_those_of_the_base(rig, start_node, frames):
    start_node(frame_id='base_link', odom_frame_id='odom_camera', camera_in_base=CAMERA_IN_BASE)
    answers = send_all(rig, frames)
    expected = offline(frames)
    T_camera_base = se3.inverse(T_BASE_CAMERA)
    for answer in answers[1:]:
        assert (answer.header.frame_id, answer.child_frame_id) == ('odom_camera', 'base_link')
        update = expected[to_stamp(answer.header.stamp)]
        T_odom_base = T_BASE_CAMERA @ update.T_odom_camera @ T_camera_base
        np.testing.assert_allclose(pose_of(answer), T_odom_base, atol=1e-6)
        twist = answer.twist.twist
        moved = se3.exp(update.increment.interval * np.array([
            twist.linear.x, twist.linear.y, twist.linear.z,
            twist.angular.x, twist.angular.y, twist.angular.z]))
        np.testing.assert_allclose(
            moved, T_BASE_CAMERA @ update.increment.pose.matrix @ T_camera_base, atol=1e-6)
        for covariance in (covariance_of(answer.pose), covariance_of(answer.twist)):
            np.testing.assert_allclose(covariance, covariance.T)
            assert np.all(np.linalg.eigvalsh(covariance) > 0)
            assert covariance[0, 0] not in (1.0, LOST)
        # per second squared: the deviation of a step of 1/30 s is 30 times that of the velocity
        step = np.sqrt(np.trace(update.increment.pose.covariance[3:, 3:]))
        rate = np.sqrt(np.trace(covariance_of(answer.twist)[3:, 3:]))
        assert rate == pytest.approx(step / update.increment.interval, rel=1e-6)


def test_while_lost_the_last_pose_without_weight_and_no_tf(rig, start_node, frames):
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    rig.listen_to_tf()
    start_node()
    shown = [*frames[:5], *map(black, frames[5:8]), *frames[8:]]
    answers = send_all(rig, shown)
    for answer in answers[5:8]:
        np.testing.assert_array_equal(pose_of(answer), pose_of(answers[4]))
        assert covariance_of(answer.pose).diagonal().tolist() == [LOST] * 6
        assert covariance_of(answer.twist).diagonal().tolist() == [LOST] * 6
        assert answer.twist.twist.linear.x == answer.twist.twist.angular.z == 0.0
    recovered = answers[8]
    assert covariance_of(recovered.pose)[0, 0] == LOST
    assert covariance_of(answers[9].pose)[0, 0] < 1.0
    step = se3.inverse(pose_of(answers[4])) @ pose_of(recovered)
    assert np.linalg.norm(step[:3, 3]) < 0.2
    stamps = [to_stamp(link.header.stamp) for link in rig.links]
    tracked = [frame.stamp for i, frame in enumerate(frames) if not 5 <= i < 8]
    assert stamps == tracked  # strictly increasing, none while lost
    for link, answer in zip(rig.links[:5], answers[:5]):
        assert (link.header.frame_id, link.child_frame_id) == ('odom', OPTICAL)
        np.testing.assert_allclose(from_transform(link.transform), pose_of(answer), atol=1e-12)


def test_the_extrinsic_comes_from_tf_and_is_never_guessed(rig, start_node, frames):
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from tf2_msgs.msg import TFMessage

    from aick_ros.ros.conversions import transform_stamped
    node = start_node(frame_id='base_link')
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:3]:
        rig.send(frame)
    node.wait_for_log("no transform from 'camera_rgb_optical_frame' (the colour image) to "
                      "'base_link' (frame_id)")
    assert rig.odom == []
    latched = rig.node.create_publisher(TFMessage, '/tf_static', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    T_link_optical = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5))
    T_base_link = T_BASE_CAMERA @ se3.inverse(T_link_optical)
    latched.publish(TFMessage(transforms=[
        transform_stamped(0, 'base_link', 'camera_link', T_base_link),
        transform_stamped(0, 'camera_link', OPTICAL, T_link_optical)]))
    expected = offline(frames[:3])
    for frame in frames[:3]:  # those that waited are answered too
        T_odom_base = (T_BASE_CAMERA @ expected[frame.stamp].T_odom_camera
                       @ se3.inverse(T_BASE_CAMERA))
        np.testing.assert_allclose(pose_of(rig.answer(frame.stamp)), T_odom_base, atol=1e-6)


def bad_messages(frame, image_message):
    """Damaged pairs of messages by the sentence the log must have, at the stamp of a frame."""
    stamp, colour, depth = frame.stamp, frame.colour, frame.depth
    truncated = image_message(stamp, 'rgb8', colour)
    truncated.data = truncated.data[:1000]
    grown = image_message(stamp, 'rgb8', colour)
    grown.height *= 2
    unknown = image_message(stamp, 'rgb8', colour)
    unknown.encoding = 'rgb17'
    nothing = np.full_like(depth, np.nan)
    return [
        ('32FC1', {'colour': image_message(stamp, '32FC1', depth)}),
        ('rgb8', {'depth': image_message(stamp, 'rgb8', colour)}),
        ('1000', {'colour': truncated}),
        ('480', {'colour': grown}),
        ('rgb17', {'colour': unknown}),
        ('200 x 150', {'depth': image_message(stamp, '32FC1', depth[:150, :200].copy())}),
        ('too few keypoints', {'colour': image_message(stamp, 'rgb8', np.zeros_like(colour)),
                               'depth': image_message(stamp, '32FC1', nothing)}),
    ]


@pytest.mark.parametrize('kind', range(7))
def test_after_a_damaged_frame_the_next_good_one_is_answered(rig, start_node, frames, kind):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    sentence, damaged = bad_messages(frames[3], rig.image_message)[kind]
    for frame in frames[:3]:
        rig.send(frame)
    rig.send(frames[3], **damaged)
    for frame in frames[4:8]:
        rig.send(frame)
    expected = offline([*frames[:3], *frames[4:8]])
    for stamp, update in expected.items():
        np.testing.assert_allclose(pose_of(rig.answer(stamp)), update.T_odom_camera, atol=1e-6)
    node.wait_for_log(sentence)
    assert 'Traceback' not in node.log


def test_a_frame_without_depth_is_answered_by_colour_alone(rig, start_node, frames):
    node = start_node()
    nothing = np.full_like(frames[3].depth, np.nan)
    blind = [*frames[:3], dataclasses.replace(frames[3], depth=nothing), *frames[4:6]]
    rig.send_camera_info(frames[0].camera)
    for frame in blind:
        rig.send(frame)
    for stamp, update in offline(blind).items():
        assert update.status.ok
        np.testing.assert_allclose(pose_of(rig.answer(stamp)), update.T_odom_camera, atol=1e-6)
    assert 'too few keypoints' not in node.log


def test_camera_info_of_zeros_is_rejected_and_frames_wait(rig, start_node, frames):
    node = start_node()
    rig.info.publish(CameraInfo(width=640, height=480))
    for frame in frames[:3]:
        rig.send(frame)
    node.wait_for_log('camera_info on /rgb/camera_info rejected: camera_info is not calibrated: '
                      'k[0] is 0')
    assert rig.odom == []
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:3]:
        rig.answer(frame.stamp)


def test_images_whose_stamp_repeats_or_goes_back_are_rejected(rig, start_node, frames):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    for i in (0, 1, 2, 2, 1, 3, 4):
        rig.send(frames[i])
    for frame in frames[:5]:
        rig.answer(frame.stamp)
    node.wait_for_log('repeats or goes back')
    assert rig.stamps() == [frame.stamp for frame in frames[:5]]


def test_a_recording_played_again_goes_on_from_the_pose_reached(rig, start_node, frames):
    start_node()
    before = send_all(rig, frames)[-1]
    again = [dataclasses.replace(frame, stamp=frame.stamp - 10 ** 10, depth_stamp=None)
             for frame in frames]
    first, *_, last = send_all(rig, again)
    np.testing.assert_allclose(pose_of(first), pose_of(before), atol=1e-9)
    assert np.linalg.norm(pose_of(last)[:3, 3] - pose_of(first)[:3, 3]) < 1.0


def test_padded_rows_and_millimetres_of_either_byte_order(rig, start_node, frames):
    start_node()
    rig.send_camera_info(frames[0].camera)
    expected = []
    for i, frame in enumerate(frames[:6]):
        millimetres = np.where(np.isnan(frame.depth), 0, np.rint(1000 * frame.depth)).astype(
            '>u2' if i % 2 else '<u2')
        padded = np.zeros((240, 350, 3), np.uint8)
        padded[:, :320] = frame.colour
        colour = rig.image_message(frame.stamp, 'rgb8', padded)
        colour.width = 320
        rig.send(frame, colour, rig.image_message(frame.stamp, '16UC1', millimetres))
        metres = (millimetres / 1000.0).astype(np.float32)
        expected.append(dataclasses.replace(frame, depth=np.where(metres > 0, metres, np.nan)))
    for stamp, update in offline(expected).items():
        np.testing.assert_allclose(pose_of(rig.answer(stamp)), update.T_odom_camera, atol=1e-6)


def test_frames_that_wait_for_a_partner_are_answered_when_none_can_come(rig, start_node, frames):
    """Stamps half a period apart: the last pair is decided by silence."""
    start_node()
    late = [dataclasses.replace(frame, depth_stamp=frame.stamp + 15_000_000)
            for frame in frames[:4]]
    assert len(send_all(rig, late)) == 4


def test_diagnostics_report_the_status(rig, start_node, frames):
    start_node()
    send_all(rig, [*frames[:4], black(frames[4])])
    rig.wait_until(lambda: any('keypoints' in message.status[0].message
                               for message in rig.diagnostics), 'the loss in /diagnostics')
    status = rig.diagnostics[-1].status[0]
    values = {value.key: value.value for value in status.values}
    assert status.name == 'odom_node: odometry'
    assert status.level == b'\x01'
    assert values['frames answered'] == '5'
    assert values['frames lost'] == '1'
    assert values['lost share'] == '0.200'
    # of the frames after the first; that of the dark one is none
    support = [update.support for update in offline([*frames[:4], black(frames[4])]).values()]
    assert float(values['inliers']) == np.median(support) > 100
    stages = [float(values[f'{stage} [ms]']) for stage in STAGES]
    assert all(stage > 0 for stage in stages)
    assert float(values['delay [ms]']) > float(values['total [ms]']) > 0
    assert float(values['input rate [Hz]']) >= float(values['output rate [Hz]']) > 0
    assert (values['backlog'], values['frames dropped under load']) == ('0', '0')


def test_a_publisher_whose_qos_does_not_match_is_explained(rig, start_node, frames):
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import Image
    rig.withdraw(rig.colour)
    rig.colour = rig.node.create_publisher(Image, 'rgb/image', QoSProfile(
        depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    node = start_node(wait=False)
    node.wait_for_log('nothing on /rgb/image for 5 s: the QoS of rig does not match ours')
    assert 'set qos_reliability to auto' in node.log


def test_a_camera_info_sent_once_is_enough(rig, start_node, frames):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    start = time.monotonic()  # silence of 5 s is reported
    for i in itertools.count():
        rig.send(dataclasses.replace(frames[i % 2], stamp=frames[0].stamp + i * 10 ** 8,
                                     depth_stamp=None))
        time.sleep(0.2)
        status, passed = rig.diagnostics[-1].status[0], time.monotonic() - start
        if passed > 7.0 and status.level == b'\x00':
            break
        assert passed < rig.patience, status.message
    assert 'camera_info' not in node.log


def test_frames_that_wait_keep_the_camera_they_came_with(rig, start_node, frames):
    start_node(preset='paper-full')
    rig.send_camera_info(frames[0].camera)
    rig.send(frames[0])
    rig.answer(frames[0].stamp)
    for frame in frames[1:8]:
        rig.send(frame)
    rig.wait_until(lambda: rig.values().get('frames received') == '8', 'all to be paired')
    rig.send_camera_info(dataclasses.replace(frames[0].camera, fx=900.0, fy=900.0))
    odometry = Odometry(preset('paper-full'))
    for frame in frames[:8]:
        expected = odometry.register_frame(frame).T_odom_camera
        np.testing.assert_allclose(pose_of(rig.answer(frame.stamp)), expected, atol=1e-6)


def test_images_without_a_stamp_are_rejected(rig, start_node, frames):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    rig.send(dataclasses.replace(frames[0], stamp=0, depth_stamp=None))
    for frame in frames[:3]:
        rig.send(frame)
    rig.answer(frames[2].stamp)
    assert rig.stamps() == [frame.stamp for frame in frames[:3]]
    node.wait_for_log('its stamp is 0 ns; the driver must stamp its images')


def test_an_image_of_an_unknown_frame_does_not_block_the_others(rig, start_node, frames):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    for i, frame in enumerate(frames[:6]):
        rig.send(frame, colour=rig.image_message(
            frame.stamp, 'rgb8', frame.colour, 'elsewhere' if i in (0, 3) else OPTICAL))
    good = [frame.stamp for i, frame in enumerate(frames[:6]) if i not in (0, 3)]
    for stamp in good:
        rig.answer(stamp)
    assert rig.stamps() == good
    node.wait_for_log("no transform from 'elsewhere'")


def test_colour_and_depth_that_never_pair_are_reported(rig, start_node, frames):
    node = start_node()
    stop = time.monotonic() + rig.patience
    for i in itertools.count():
        if 'synchronize the camera, or raise it' in node.log:
            break
        assert time.monotonic() < stop, node.log
        frame = frames[i % len(frames)]
        stamp = frames[0].stamp + i * 200_000_000
        rig.send_camera_info(frame.camera)
        rig.send(dataclasses.replace(frame, stamp=stamp, depth_stamp=stamp + 50_000_000))
        time.sleep(0.1)
    assert rig.odom == []
    assert 'approx_sync_max_interval = 0.02 s' in node.log


def test_an_interval_of_zero_is_no_limit(rig, start_node, frames):
    start_node(approx_sync_max_interval='0.0')
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:4]:
        rig.send(dataclasses.replace(frame, depth_stamp=frame.stamp + 8_000_000))
    for frame in frames[:4]:
        rig.answer(frame.stamp)


def test_without_approx_sync_only_equal_stamps_are_a_pair(rig, start_node, frames):
    start_node(approx_sync='false')
    rig.send_camera_info(frames[0].camera)
    for i, frame in enumerate(frames[:6]):
        rig.send(dataclasses.replace(frame, depth_stamp=frame.stamp + (i % 2) * 1_000_000))
    kept = [dataclasses.replace(frame, depth_stamp=None) for frame in frames[:6:2]]
    for stamp, update in offline(kept).items():
        np.testing.assert_allclose(pose_of(rig.answer(stamp)), update.T_odom_camera, atol=1e-6)
    rig.wait_until(lambda: rig.values().get('depth images without colour', '0') != '0',
                   'the count of what found no partner')
    assert rig.stamps() == [frame.stamp for frame in kept]


def test_without_publish_tf_it_is_left_to_others(rig, start_node, frames):
    rig.listen_to_tf()
    start_node(publish_tf='false')
    send_all(rig, frames[:3])
    assert not rig.node.get_publishers_info_by_topic('/tf')
    assert rig.links == []


def test_silence_names_the_topics(rig, start_node, frames):
    node = start_node()
    node.wait_for_log('nothing on /depth/image for 5 s, though rig is there: it sends no images')
    assert 'nothing on /rgb/camera_info' in node.log


def test_where_nobody_publishes_the_topics_that_have_images_are_named(rig, start_node):
    rig.node.create_publisher(Image, '/camera/image_raw', 1)
    node = start_node(wait=False, remappings=['rgb/image:=/nowhere'])
    node.wait_for_log('nobody publishes /nowhere: start the camera, or remap rgb/image to its '
                      'topics; there are images on /camera/image_raw, /rgb/image')


def test_the_parameter_file_of_the_package_is_taken_and_leaves_the_preset_alone(
        rig, start_node, frames):
    file = Path(__file__).parents[2] / 'config' / 'odom_node.yaml'
    start_node('--ros-args', '--params-file', str(file), preset='paper-fast')
    answers = send_all(rig, frames[:5])
    odometry = Odometry(preset('paper-fast'))
    for frame, answer in zip(frames, answers):
        np.testing.assert_allclose(pose_of(answer), odometry.register_frame(frame).T_odom_camera,
                                   atol=1e-6)
