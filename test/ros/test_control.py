# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Requests to the node: what is rejected; reset, pause and set a pose, of the whole node."""

import dataclasses

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter, parameter_value_to_python
from scipy.spatial.transform import Rotation
from std_srvs.srv import Empty

from aick_ros.geometry import se3
from aick_ros.odometry import Odometry
from aick_ros.ros import control
from aick_ros.ros.control import Control
from aick_ros.ros.conversions import from_pose, pose_with_covariance
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

COUNT = 10


MARK = 12345.0  # m, x of a pose that is sent after another one


class Asked:
    """A node with its requests, what they lead to, and who makes them."""

    def __init__(self, graph):
        self._graph, self.node = graph, graph.node()
        self.resets, self.pauses, self.poses = [], [], []
        self.control = Control(self.node, 'odom', self.resets.append,
                               lambda: self.pauses.append(self.control.paused),
                               lambda pose, paused: self.poses.append((pose, paused)))
        self._publisher = graph.beside.create_publisher(PoseWithCovarianceStamped, 'set_pose', 10)

    @property
    def log(self):
        return self._graph.log(self.node)

    def call(self, name, kind=Empty, **request):
        self._graph.call(self.node, kind, f'odom_node/{name}', kind.Request(**request))

    def set_pose(self, message):
        """Publish a pose, and wait until it has been taken."""
        self._graph.wait_until(self._publisher.get_subscription_count, 'who takes a pose')
        self._publisher.publish(message)
        self._publisher.publish(pose_with_covariance(
            0, 'odom', se3.exp([MARK, 0, 0, 0, 0, 0]), np.eye(6)))
        self._graph.wait_until(
            lambda: any(pose.matrix[0, 3] == MARK for pose, _ in self.poses), 'it', self.node)
        self.poses.pop()


@pytest.fixture
def asked(graph):
    return Asked(graph)


@pytest.fixture
def reset_to(graph, rtabmap_types, monkeypatch):
    """Return a function that asks for a reset to a pose, and returns who is asked."""
    monkeypatch.setattr(control, 'ResetPose', rtabmap_types['ResetPose'])

    def reset(**numbers):
        asked = Asked(graph)
        asked.call('reset_odom_to_pose', rtabmap_types['ResetPose'], **numbers)
        return asked
    return reset


def own_services(node):
    """Return the types of a node's services by their names, but for those of parameters."""
    return {name: service.srv_type for service in node.services
            if 'parameter' not in (name := service.service_name) and 'type_desc' not in name}


def test_services_and_topic_have_the_names_and_types_of_rgbd_odometry(asked):
    services = own_services(asked.node)
    services.pop('/odom_node/reset_odom_to_pose', None)  # where its message is installed
    assert services == {f'/odom_node/{name}': Empty for name in (
        'reset_odom', 'pause_odom', 'resume_odom', 'log_debug', 'log_info', 'log_warning',
        'log_error')}
    [topic] = [each for each in asked.node.subscriptions if each.topic_name == '/set_pose']
    assert (topic.msg_type, topic.qos_profile.depth) == (PoseWithCovarianceStamped, 10)


def test_without_its_message_there_is_no_reset_to_a_pose(graph, monkeypatch):
    monkeypatch.setattr(control, 'ResetPose', None)
    assert '/odom_node/reset_odom_to_pose' not in own_services(Asked(graph).node)


def test_each_request_does_its_own(asked):
    assert not asked.control.paused
    asked.call('pause_odom')
    assert asked.control.paused
    asked.call('resume_odom')
    assert not asked.control.paused
    asked.call('reset_odom')
    assert asked.resets == [None]
    assert asked.log == [(LoggingSeverity.INFO, 'paused'), (LoggingSeverity.INFO, 'resumed')]


@pytest.mark.parametrize('name, level', [
    ('debug', LoggingSeverity.DEBUG), ('info', LoggingSeverity.INFO),
    ('warning', LoggingSeverity.WARN), ('error', LoggingSeverity.ERROR)])
def test_the_log_has_the_level_that_is_asked_for(asked, name, level):
    asked.call(f'log_{name}')
    assert asked.node.get_logger().get_effective_level() == level


def test_a_reset_to_a_pose_turns_about_the_fixed_axes_x_then_y_then_z(reset_to):
    [pose] = reset_to(x=1.0, y=-2.0, z=3.0, roll=0.1, pitch=-0.2, yaw=2.0).resets
    angles = np.array([0.1, -0.2, 2.0], np.float32)  # as the message has them
    np.testing.assert_allclose(
        pose.matrix[:3, :3], Rotation.from_euler('xyz', angles).as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(pose.matrix[:3, 3], (1.0, -2.0, 3.0))
    np.testing.assert_array_equal(pose.covariance, np.zeros((6, 6)))


@pytest.mark.parametrize('numbers, reason', [
    ({'roll': np.nan}, 'its angles are not finite'), ({'yaw': np.inf}, 'its angles are not fin'),
    ({'x': np.nan}, 'what it asks for'), ({'z': 1e12}, 'what it asks for')])
def test_a_reset_to_no_pose_is_rejected_with_a_sentence(reset_to, numbers, reason):
    asked = reset_to(**numbers)
    assert asked.resets == []
    [(level, sentence)] = asked.log
    assert level is LoggingSeverity.WARN
    assert sentence.startswith(f'reset_odom_to_pose rejected: {reason}')


POSE = se3.exp([3, -1, 2, 0.2, 0.1, 2.0])


def test_it_is_paused_when_that_is_passed_on(asked):
    asked.call('pause_odom')
    assert asked.pauses == [True]


@pytest.mark.parametrize('frame', ['odom', '', '/odom'])
@pytest.mark.parametrize('paused', [False, True])
def test_a_pose_to_set_is_passed_on_with_its_covariance(asked, frame, paused):
    if paused:
        asked.call('pause_odom')
    covariance = np.diag([2, 3, 4, 5, 6, 7.0])
    covariance[0, 1] = 0.5  # of a sender that fills one half
    asked.set_pose(pose_with_covariance(0, frame, POSE, covariance))
    [(pose, was_paused)] = asked.poses
    assert was_paused is paused
    np.testing.assert_allclose(pose.matrix, POSE, atol=1e-12)
    np.testing.assert_array_equal(pose.covariance, pose.covariance.T)
    np.testing.assert_array_equal(np.diag(pose.covariance), np.diag(covariance))
    assert pose.covariance[1, 0] == 0.25


def test_a_pose_to_set_may_be_certain(asked):
    message = pose_with_covariance(0, '', POSE, np.eye(6))
    message.pose.covariance = np.zeros(36)
    asked.set_pose(message)
    np.testing.assert_array_equal(asked.poses[0][0].covariance, np.zeros((6, 6)))


@pytest.mark.parametrize('place, value, reason', [
    (0, np.nan, 'not finite, or more than 1e+16'), (8, -np.inf, 'not finite, or more than 1e+16'),
    (0, 1.1e16, 'not finite, or more than 1e+16'), (1, 1.7e308, 'not finite, or more than 1e+16'),
    (7, -1.0, 'not positive semidefinite'), (1, 5.0, 'not positive semidefinite')])
def test_a_covariance_that_is_none_is_rejected(asked, place, value, reason):
    """Not finite, absurd, of a negative variance, or of a correlation of more than one."""
    message = pose_with_covariance(0, 'odom', POSE, np.diag([2.0] * 6))
    message.pose.covariance[place] = value
    asked.set_pose(message)
    assert asked.poses == []
    assert asked.log == [(LoggingSeverity.WARN, f'set_pose rejected: its covariance is {reason}')]


def test_a_large_covariance_that_is_singular_to_rounding_is_taken(asked):
    """As of six times one unknown number, which has five eigenvalues of zero."""
    numbers = np.outer(*2 * [np.array([1e6, 3e6, -7e5, 2e6, 1.1e6, -9e5])])
    assert np.linalg.eigvalsh(numbers)[0] < -1e-9
    asked.set_pose(pose_with_covariance(0, 'odom', POSE, numbers))
    [(pose, _)] = asked.poses
    np.testing.assert_array_equal(pose.covariance, numbers)


def test_what_is_rejected_again_and_again_is_not_logged_each_time(asked):
    for _ in range(20):
        asked.set_pose(pose_with_covariance(0, 'x' * 10 ** 6, POSE, np.eye(6)))
    lines = [line for _, line in asked.log]
    assert 0 < len(lines) < 20
    assert max(map(len, lines)) < 1000


def test_a_pose_in_another_frame_is_rejected(asked):
    asked.set_pose(pose_with_covariance(0, 'map', POSE, np.eye(6)))
    assert asked.poses == []
    [(_, sentence)] = asked.log
    assert sentence == (
        "set_pose rejected: its frame is 'map': 'odom' (odom_frame_id) is required")


def test_a_pose_of_no_rotation_is_rejected(asked):
    message = pose_with_covariance(0, 'odom', POSE, np.eye(6))
    message.pose.pose.orientation = Quaternion(w=0.0)
    asked.set_pose(message)
    assert asked.poses == []
    [(_, sentence)] = asked.log
    assert sentence.startswith('set_pose rejected: ')
    assert sentence.endswith('; all numbers must be finite, and the quaternion not zero')


# Of the whole node.


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:COUNT])


def offline(frames, before_reset=()):
    """Return the poses without ROS; what was learnt of the camera outlives a reset."""
    odometry = Odometry()
    for frame in before_reset:
        odometry.register_frame(frame)
    odometry.reset()
    return [odometry.register_frame(frame).T_odom_camera for frame in frames]


def answers(rig, frames):
    """Send frames and return the poses that come back."""
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
    return [from_pose(rig.answer(frame.stamp).pose.pose) for frame in frames]


def set_parameters(rig, **changes):
    """Set parameters as ``ros2 param set`` does; return the results."""
    return rig.call(SetParameters, '/odom_node/set_parameters', SetParameters.Request(parameters=[
        Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
        for name, value in changes.items()])).results


def test_the_level_of_the_log_can_be_changed(rig, start_node, frames):
    node = start_node()
    rig.call(Empty, '/odom_node/log_error')
    rig.call(Empty, '/odom_node/pause_odom')
    rig.call(Empty, '/odom_node/log_info')
    rig.call(Empty, '/odom_node/resume_odom')
    node.wait_for_log('resumed')
    assert 'paused' not in node.log


def test_a_parameter_cannot_be_deleted(rig, start_node):
    start_node()
    [result] = set_parameters(rig, aick__alpha=None)
    assert not result.successful
    assert result.reason == 'aick.alpha cannot be deleted: set it to another value'


def test_requests_before_the_first_frame_are_those_of_its_pose(rig, start_node, frames):
    """The last of them counts; to resume what is not paused changes nothing."""
    node = start_node()
    pub = rig.node.create_publisher(PoseWithCovarianceStamped, 'set_pose', 10)
    rig.wait_until(pub.get_subscription_count, 'who takes a pose')
    rig.call(Empty, '/odom_node/resume_odom')
    for _ in range(2):
        rig.call(Empty, '/odom_node/reset_odom')
    node.wait_for_log('odometry reset')
    pub.publish(pose_with_covariance(0, 'odom', se3.exp([5, 0, 0, 0, 0, 0.5]), np.eye(6)))
    node.wait_for_log('pose set')
    rig.send_camera_info(frames[0].camera)
    rig.send(frames[0])
    np.testing.assert_allclose(from_pose(rig.answer(frames[0].stamp).pose.pose),
                               se3.exp([5, 0, 0, 0, 0, 0.5]), atol=1e-6)


def test_reset_begins_at_the_origin(rig, start_node, frames):
    start_node()
    answers(rig, frames[:4])
    rig.call(Empty, '/odom_node/reset_odom')
    after = answers(rig, frames[4:7])
    np.testing.assert_array_equal(after[0], np.eye(4))
    np.testing.assert_allclose(after, offline(frames[4:7], frames[:4]), atol=1e-6)


def test_reset_to_a_pose_begins_there(rtabmap_msgs, rig, start_node, frames):
    from rtabmap_msgs.srv import ResetPose
    node = start_node(initial_pose='[9.0, 9.0, 9.0, 0.0, 0.0, 0.0]')
    answers(rig, frames[:3])
    rig.call(ResetPose, '/odom_node/reset_odom_to_pose',
             ResetPose.Request(x=1.0, y=-2.0, z=3.0, roll=0.1, pitch=-0.2, yaw=2.0))
    after = answers(rig, frames[3:6])
    # rotations about the fixed axes x, y, z are those about the moving ones z, y, x
    axes = [Rotation.from_euler('ZYX', [2.0, -0.2, 0.1]).as_matrix(), [[1.0], [-2.0], [3.0]]]
    np.testing.assert_allclose(after[0][:3], np.hstack(axes), atol=1e-6)
    for pose, expected in zip(after, offline(frames[3:6], frames[:3])):
        np.testing.assert_allclose(pose, after[0] @ expected, atol=1e-6)
    for wrong, reason in (('yaw', 'its angles are not finite'), ('x', 'what it asks for is not')):
        rig.call(ResetPose, '/odom_node/reset_odom_to_pose',
                 ResetPose.Request(**{wrong: float('inf')}))
        node.wait_for_log(f'reset_odom_to_pose rejected: {reason}')
    np.testing.assert_allclose(answers(rig, frames[6:7])[0],
                               after[0] @ offline(frames[3:7], frames[:3])[-1], atol=1e-6)


def test_under_the_name_of_rtabmaps_node_the_service_is_where_rtabmap_viz_calls_it(
        rig, start_node, frames):
    start_node(remappings=['__node:=rgbd_odometry'])
    answers(rig, frames[:3])
    rig.call(Empty, '/rgbd_odometry/reset_odom')
    np.testing.assert_array_equal(answers(rig, frames[3:4])[0], np.eye(4))


def test_paused_it_is_silent_and_resumed_it_goes_on(rig, start_node, frames):
    start_node()
    answers(rig, frames[:3])
    rig.call(Empty, '/odom_node/pause_odom')
    for frame in frames[3:6]:
        rig.send(frame)
    rig.wait_until(lambda: any(
        value.key == 'frames skipped while paused' and value.value == '3'
        for value in rig.diagnostics[-1].status[0].values), 'the skipped frames')
    assert 'paused' in rig.diagnostics[-1].status[0].message
    rig.call(Empty, '/odom_node/resume_odom')
    after = answers(rig, frames[6:])
    assert rig.stamps() == [frame.stamp for frame in [*frames[:3], *frames[6:]]]
    expected = offline([*frames[:3], *frames[6:]])[3:]
    np.testing.assert_allclose(after, expected, atol=1e-6)


@pytest.mark.parametrize('given_in', ['odom', ''])
def test_from_a_pose_that_was_set_the_motion_goes_on(rig, start_node, frames, given_in):
    node = start_node()
    answers(rig, frames[:3])
    pose_set, covariance_set = se3.exp([3, -1, 2, 0.2, 0.1, 2.0]), np.diag([1, 2, 3, 4, 5, 6.0])
    publisher = rig.node.create_publisher(PoseWithCovarianceStamped, 'set_pose', 1)
    rig.wait_until(publisher.get_subscription_count, 'the node to listen to set_pose')
    publisher.publish(pose_with_covariance(0, 'map', pose_set, covariance_set))
    node.wait_for_log("set_pose rejected: its frame is 'map': 'odom' (odom_frame_id) is required")
    publisher.publish(pose_with_covariance(0, given_in, pose_set, covariance_set))
    node.wait_for_log('pose set')
    after = answers(rig, frames[3:6])
    chain = offline(frames[:6])
    for pose, expected in zip(after, chain[3:]):
        np.testing.assert_allclose(pose, pose_set @ se3.inverse(chain[2]) @ expected, atol=1e-6)
    covariance = np.reshape(rig.odom[-1].pose.covariance, (6, 6))
    assert covariance[5, 5] == pytest.approx(6.0, rel=0.01)


def covered(frame):
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                               depth=np.full_like(frame.depth, np.nan))


def lose_sight(rig, frames):
    answers(rig, [*frames[:3], *map(covered, frames[3:5])])
    assert rig.odom[-1].pose.covariance[0] == 9999.0


def pause(rig, frames):
    answers(rig, frames[:3])
    rig.call(Empty, '/odom_node/pause_odom')


@pytest.mark.parametrize('blind', [lose_sight, pause])
def test_a_pose_that_was_set_unseen_is_where_the_camera_is_found_again(
        rig, start_node, frames, blind):
    """The motion that the camera sees since before led to the pose; it does not follow it."""
    node = start_node()
    blind(rig, frames)
    pose_set = se3.exp([3, -1, 2, 0.2, 0.1, 2.0])
    publisher = rig.node.create_publisher(PoseWithCovarianceStamped, 'set_pose', 1)
    rig.wait_until(publisher.get_subscription_count, 'the node to listen to set_pose')
    publisher.publish(pose_with_covariance(0, 'odom', pose_set, np.eye(6)))
    node.wait_for_log('pose set')
    rig.call(Empty, '/odom_node/resume_odom')
    after = answers(rig, frames[5:8])
    chain = offline([*frames[:3], *map(covered, frames[3:5]), *frames[5:8]]
                    if blind is lose_sight else [*frames[:3], *frames[5:8]])[-3:]
    assert np.abs(chain[0] - np.eye(4)).max() > 0.01  # it was found where it is now
    for pose, expected in zip(after, chain):
        np.testing.assert_allclose(pose, pose_set @ se3.inverse(chain[0]) @ expected, atol=1e-6)


def test_a_reset_while_lost_begins_where_the_camera_is_found_again(rig, start_node, frames):
    start_node()
    lose_sight(rig, frames)
    rig.call(Empty, '/odom_node/reset_odom')
    still = answers(rig, [covered(frames[5])])
    np.testing.assert_array_equal(still[0], np.eye(4))
    assert rig.odom[-1].pose.covariance[0] == 9999.0
    expected = offline([covered(frames[5]), *frames[6:9]],
                       [*frames[:3], *map(covered, frames[3:5])])[1:]
    np.testing.assert_allclose(answers(rig, frames[6:9]), expected, atol=1e-6)


def test_paused_while_lost_it_finds_back_when_resumed(rig, start_node, frames):
    start_node()
    lose_sight(rig, frames)
    rig.call(Empty, '/odom_node/pause_odom')
    rig.send(frames[5])
    rig.wait_until(lambda: rig.values().get('frames skipped while paused') == '1',
                   'the skipped frame')
    rig.call(Empty, '/odom_node/resume_odom')
    after = answers(rig, frames[6:8])
    expected = offline([*frames[:3], *map(covered, frames[3:5]), *frames[6:8]])[-2:]
    np.testing.assert_allclose(after, expected, atol=1e-6)
    assert [message.pose.covariance[0] < 9999.0 for message in rig.odom[-2:]] == [False, True]


def test_it_starts_at_the_initial_pose(rig, start_node, frames):
    start_node(initial_pose='[1.0, 2.0, 3.0, 0.1, 0.2, 0.3]')
    T = se3.from_roll_pitch_yaw(0.1, 0.2, 0.3, (1, 2, 3))
    found = answers(rig, frames[:3])
    np.testing.assert_allclose(found, [T @ pose for pose in offline(frames[:3])], atol=1e-6)


def test_parameters_change_between_two_frames(rig, start_node, frames):
    start_node()
    before = answers(rig, frames[:4])
    refused, taken = set_parameters(rig, odometry__max_speed=5000.0, features__max_keypoints=150)
    assert not refused.successful
    assert refused.reason.startswith('odometry.max_speed = 5000.0 is outside 0.01 to 1000 m/s')
    assert taken.successful
    odometry = Odometry()
    expected = [odometry.register_frame(frame).T_odom_camera for frame in frames[:4]]
    odometry.change_settings(with_values(Settings(), {'features.max_keypoints': 150}))
    expected += [odometry.register_frame(frame).T_odom_camera for frame in frames[4:]]
    np.testing.assert_allclose(before + answers(rig, frames[4:]), expected, atol=1e-6)
    assert np.abs(expected[-1] - offline(frames)[-1]).max() > 1e-6  # the change was one


def test_read_only_and_unknown_parameters_say_so(rig, start_node):
    start_node()
    own, misspelt = set_parameters(rig, odom_frame_id='map', aick__alpah=0.5)
    assert 'odom_frame_id is read at the start only' in own.reason
    assert 'did you mean aick.alpha' in misspelt.reason


def dump(rig, node):
    """Return the parameters of a node as ``ros2 param dump`` writes them."""
    names = rig.call(ListParameters, f'/{node}/list_parameters').result.names
    values = rig.call(GetParameters, f'/{node}/get_parameters',
                      GetParameters.Request(names=names)).values
    tree = {}
    for name, value in sorted(zip(names, map(parameter_value_to_python, values))):
        *groups, last = name.split('.')
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = list(value) if hasattr(value, 'tolist') else value
    return {f'/{node}': {'ros__parameters': tree}}


def test_a_dump_of_the_parameters_starts_the_same_node(rig, start_node, frames, tmp_path):
    first = start_node(preset='paper-fast', odom_frame_id='odom_camera',
                       initial_pose='[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]', features__orb__levels=6)
    assert set_parameters(rig, aick__alpha=0.65)[0].successful
    dumped = dump(rig, 'odom_node')
    file = tmp_path / 'dump.yaml'
    file.write_text(yaml.dump(dumped))
    before = answers(rig, frames[:4])
    first.stop()
    rig.odom.clear()
    rig.diagnostics.clear()
    second = start_node('--ros-args', '--params-file', str(file), bare=True)
    np.testing.assert_allclose(answers(rig, frames[:4]), before, atol=1e-9)
    assert dump(rig, 'odom_node') == dumped
    assert 'changes nothing' not in second.log


def test_unknown_parameters_are_reported(rig, start_node):
    node = start_node(aick__alhpa=0.5)
    node.wait_for_log("parameter 'aick.alhpa' is not one of this node and changes nothing: did "
                      'you mean aick.alpha')


def test_frames_are_skipped_evenly(rig, start_node, frames):
    start_node(max_update_rate=15.0)
    rig.send_camera_info(frames[0].camera)
    for frame in frames[:9]:
        rig.send(frame)
    kept = frames[:9:2]
    found = [from_pose(rig.answer(frame.stamp).pose.pose) for frame in kept]
    assert rig.stamps() == [frame.stamp for frame in kept]
    np.testing.assert_allclose(found, offline(kept), atol=1e-6)
