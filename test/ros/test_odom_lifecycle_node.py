# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The node with a life cycle, as a manager leads it from state to state."""

import signal
import sys

import numpy as np
import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParameters
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from aick_ros.errors import InputError
from aick_ros.odometry import Odometry
from aick_ros.ros import odom_lifecycle_node
from aick_ros.ros.conversions import from_pose
from aick_ros.ros.odom_lifecycle_node import OdomLifecycleNode
from aick_ros.settings import Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

COMMAND = (sys.executable, '-c', 'from aick_ros.ros.process.entry_points import '
           'odom_lifecycle_node; odom_lifecycle_node()')
OPTICAL = 'camera_rgb_optical_frame'
SUITABLE = {'process_every_frame': True, 'qos_reliability': 'reliable', 'topic_queue_size': 100,
            'sync_queue_size': 100, 'frame_id': OPTICAL}
COUNT = 9
SUCCESS, FAILURE, ERROR = (TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE,
                           TransitionCallbackReturn.ERROR)


@pytest.fixture(scope='module')
def frames():
    source = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT))
    return [source.frame(i) for i in range(COUNT)]


def change(rig, transition):
    """Ask for a transition by its number, as nav2 does; return whether it succeeded."""
    request = ChangeState.Request()
    request.transition.id = getattr(Transition, f'TRANSITION_{transition.upper()}')
    return rig.call(ChangeState, '/odom_node/change_state', request).success


def state(rig):
    return rig.call(GetState, '/odom_node/get_state').current_state.label


def set_parameters(rig, values):
    """Set parameters as ``ros2 param set`` does; return the reasons why not."""
    results = rig.call(SetParameters, '/odom_node/set_parameters', SetParameters.Request(
        parameters=[Parameter(name, value=value).to_parameter_msg()
                    for name, value in values.items()])).results
    return [result.reason for result in results if not result.successful]


def activate(rig):
    rig.diagnostics.clear()
    assert change(rig, 'activate')
    rig.wait_for_node()


def answers(rig, frames):
    """Send frames and return the poses that come back."""
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
    return [from_pose(rig.answer(frame.stamp).pose.pose) for frame in frames]


def offline(frames):
    odometry = Odometry()
    return [odometry.register_frame(frame).T_odom_camera for frame in frames]


def entities(node):
    return [len(list(kind)) for kind in (
        node.publishers, node.subscriptions, node.services, node.timers)]


def fails_twice(node, trigger, how=FAILURE):
    """Check that a transition fails twice in the same way, as the first time leaves nothing."""
    before = entities(node)
    for _ in range(2):
        assert trigger() is how
        assert entities(node) == before


@pytest.fixture
def make(ros_domain):
    """Return a function that makes the node alone, with arguments of ROS."""
    made = []

    def make(*arguments):
        rclpy.init(args=list(arguments))
        made.append(OdomLifecycleNode())
        return made[-1]

    yield make
    for node in made:
        node.close()
    rclpy.try_shutdown()


@pytest.fixture
def node(rig):
    """The node in this process, on the executor of the other side."""
    node = OdomLifecycleNode()
    rig.add(node)
    yield node
    rig.remove(node)
    node.close()


def test_it_follows_its_life_cycle(rig, node, frames):
    unconfigured = entities(node)
    assert set_parameters(rig, SUITABLE) == []
    for cycle in range(2):
        assert state(rig) == 'unconfigured'
        assert rig.node.count_publishers('odom') == 0

        assert change(rig, 'configure')
        assert rig.node.count_subscribers(rig.colour.topic_name) == 0
        assert node.count_publishers('odom') == 1
        configured = entities(node)

        activate(rig)
        before = answers(rig, frames[:3])
        assert change(rig, 'deactivate')
        assert entities(node) == configured
        rig.wait_until(lambda: not rig.colour.get_subscription_count(), 'the end of the images')
        rig.send(frames[3])

        activate(rig)  # with the same odometry
        after = answers(rig, frames[5:7])
        np.testing.assert_allclose(
            before + after, offline([*frames[:3], *frames[5:7]]), atol=1e-6)
        assert rig.stamps() == [frames[i].stamp for i in (0, 1, 2, 5, 6)]
        rig.odom.clear()

        assert change(rig, 'deactivate')
        assert change(rig, 'cleanup')
        assert entities(node) == unconfigured


def test_what_does_not_fit_its_state_is_rejected(rig, node):
    assert not change(rig, 'activate')
    assert not change(rig, 'cleanup')
    assert state(rig) == 'unconfigured'
    assert set_parameters(rig, {'frame_id': 'body'}) == []
    assert change(rig, 'configure')
    [reason] = set_parameters(rig, {'frame_id': 'base'})
    assert reason == ('frame_id is read by configure only: clean the node up before, and '
                      'configure it afterwards')
    assert not change(rig, 'configure')
    assert state(rig) == 'inactive'
    assert change(rig, 'inactive_shutdown')
    assert state(rig) == 'finalized'


@pytest.mark.parametrize('rule', ['odom:=rgb/image', 'depth/image:=rgb/camera_info'])
def test_an_activation_that_fails_leaves_nothing(make, capfd, rule):
    node = make('--ros-args', '-r', rule)
    node.trigger_configure()
    fails_twice(node, node.trigger_activate)
    assert 'messages of two types' in capfd.readouterr().err


def test_what_cannot_be_configured_says_why_and_stays_unconfigured(rig, start_node):
    node = start_node(wait=False, command=COMMAND, aick__alpha=1.5,
                      camera_in_base='[1.0, 2.0, 3.0]')
    assert not change(rig, 'configure')
    node.wait_for_log('aick.alpha = 1.5 is outside 0 to 1')
    assert set_parameters(rig, {'aick.alpha': 0.6}) == []
    assert not change(rig, 'configure')
    node.wait_for_log('camera_in_base = [1.0, 2.0, 3.0]')
    assert rig.node.count_publishers('odom') == 0
    assert state(rig) == 'unconfigured'
    assert set_parameters(rig, {'camera_in_base': [0.0] * 6 + [1.0]}) == []
    assert change(rig, 'configure')
    assert node.stop() == 0
    assert 'Traceback' not in node.log


def test_ends_cleanly_in_the_middle_of_work(rig, start_node, frames):
    node = start_node(wait=False, command=COMMAND)
    assert change(rig, 'configure')
    activate(rig)
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
    rig.answer(frames[0].stamp)
    assert node.stop(signal.SIGTERM) == 0
    assert 'Traceback' not in node.log


@pytest.mark.parametrize('error, how', [
    (InputError('no such vocabulary'), FAILURE), (ZeroDivisionError('of ours'), ERROR)])
def test_what_was_made_before_a_configuration_fails_is_destroyed(
        make, monkeypatch, capfd, error, how):
    def pipeline(node, *_):
        node.create_timer(1000.0, print)
        node.create_subscription(Transition, 'rgb/image', print, 1)
        node.create_service(ChangeState, '~/reset_odom', print)
        raise error

    monkeypatch.setattr(odom_lifecycle_node, 'Pipeline', pipeline)
    node = make()
    fails_twice(node, lambda: node.on_configure(None), how)
    assert str(error) in capfd.readouterr().err


class Pipeline:
    """
    A pipeline that keeps what it is told to do.

    :ivar fails: the error of the next activation, if any.
    """

    fails = None

    def __init__(self, node, own, core):
        self.made_of, self.done = (node, own, core), []
        node.create_timer(1000.0, print)

    def activate(self):
        self.done.append('activate')
        if self.fails is not None:
            raise self.fails

    def change_settings(self, core):
        self.done.append(core)

    def __getattr__(self, name):
        return lambda: self.done.append(name)


@pytest.fixture
def alone(make, monkeypatch):
    """Return a node whose transitions the test triggers, with a pipeline that does nothing."""
    monkeypatch.setattr(odom_lifecycle_node, 'Pipeline', Pipeline)
    return make()


def set_one(node, name, value):
    return node.set_parameters_atomically([Parameter(name, value=value)])


def test_each_transition_does_its_part(alone):
    empty = entities(alone)
    assert set_one(alone, 'frame_id', 'body').successful
    assert alone.trigger_configure() is SUCCESS
    pipeline = alone._pipeline
    node, own, core = pipeline.made_of
    assert (node, own.frame_id, core) == (alone, 'body', Settings())
    for act, done in ((alone.trigger_activate, 'activate'),
                      (alone.trigger_deactivate, 'deactivate'), (alone.trigger_cleanup, 'close')):
        assert act() is SUCCESS
        assert pipeline.done[-1] == done
    assert pipeline.done == ['start', 'activate', 'deactivate', 'close']
    assert (alone._pipeline, entities(alone)) == (None, empty)
    assert alone.trigger_configure() is SUCCESS
    assert alone._pipeline is not pipeline
    assert alone.trigger_shutdown() is SUCCESS
    assert alone._pipeline is None


def test_only_what_is_configured_passes_changes_on_and_fixes_the_others(alone):
    assert set_one(alone, 'aick.alpha', 0.5).successful
    assert alone.trigger_configure() is SUCCESS
    pipeline = alone._pipeline
    assert pipeline.made_of[2].aick.alpha == 0.5
    rejected = set_one(alone, 'frame_id', 'body')
    assert rejected.reason == ('frame_id is read by configure only: clean the node up before, and '
                               'configure it afterwards')
    assert set_one(alone, 'aick.alpha', 0.7).successful
    assert pipeline.done[-1].aick.alpha == 0.7
    alone.trigger_cleanup()
    done = list(pipeline.done)
    assert set_one(alone, 'frame_id', 'body').successful
    assert set_one(alone, 'aick.alpha', 0.4).successful
    assert pipeline.done == done


@pytest.mark.parametrize('error, answer, said', [
    (InputError('no such topic'), FAILURE, 'no such topic\n'),
    (ZeroDivisionError('of ours'), ERROR, 'a transition failed, please report this:\nTraceback')])
def test_why_a_transition_fails_is_in_the_log(alone, capfd, error, answer, said):
    alone.trigger_configure()
    alone._pipeline.fails = error
    before = entities(alone)
    assert alone.on_activate(None) is answer
    assert said in capfd.readouterr().err
    if answer is FAILURE:
        assert entities(alone) == before


def test_what_fails_because_ros_ends_is_not_logged(alone, capfd):
    alone.trigger_configure()
    alone._pipeline.fails = ZeroDivisionError()
    rclpy.shutdown()
    assert alone.on_activate(None) is ERROR
    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('label', ['\x1b[31mred\nline', 'x' * 10 ** 6, 'Configure'])
def test_a_label_of_no_transition_is_harmless_in_the_log(alone, capfd, label):
    alone.get_logger().set_level(LoggingSeverity.INFO)  # that of the name, in the process
    request = ChangeState.Request(transition=Transition(id=1, label=label))
    response = alone._service_change_state.callback(request, ChangeState.Response())
    assert not response.success
    assert alone._pipeline is None
    text = capfd.readouterr().err
    assert 'there is no transition ' in text
    assert '\x1b' not in text and text.count('\n') == 1 and len(text) < 1000


def test_a_transition_may_be_asked_for_by_its_label(alone):
    request = ChangeState.Request(transition=Transition(label='configure'))
    assert alone._service_change_state.callback(request, ChangeState.Response()).success
    assert alone._pipeline is not None


def test_after_a_defect_it_is_cleaned_up(alone):
    alone.trigger_configure()
    pipeline = alone._pipeline
    assert alone.on_error(None) is SUCCESS
    assert (alone._pipeline, pipeline.done[-1]) == (None, 'close')


def test_it_is_closed_with_its_pipeline_or_without_one(alone):
    alone.trigger_configure()
    pipeline = alone._pipeline
    alone.close()
    assert pipeline.done[-1] == 'close'
