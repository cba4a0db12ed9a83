# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ROS parameters are those of the settings, with their descriptions and ranges."""

import numpy as np
import pytest
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter as RosParameter

from aick_ros.errors import InputError
from aick_ros.ros.parameters import LiveSettings, declare_settings, initial_pose
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import parameters, values, with_values
from aick_ros.settings.presets import PRESETS, preset


@pytest.fixture
def make_node(graph):
    """Return a function that makes a node with parameters."""
    return lambda **overrides: graph.node(
        automatically_declare_parameters_from_overrides=True, parameter_overrides=[
            RosParameter(name.replace('__', '.'), value=value)
            for name, value in overrides.items()])


def test_every_parameter_is_declared_with_description_range_and_unit(make_node):
    node = make_node()
    assert declare_settings(node) == (NodeSettings(), Settings())
    for group in (NodeSettings, Settings):
        for parameter in parameters(group):
            descriptor = node.describe_parameter(parameter.name)
            assert descriptor.description.startswith(parameter.description)
            assert parameter.unit in descriptor.description
            assert descriptor.read_only == (group is NodeSettings)
            if parameter.type is float:
                assert descriptor.floating_point_range[0].to_value == parameter.maximum
            if parameter.type is int:
                assert descriptor.integer_range[0].from_value == parameter.minimum


def test_what_the_user_sets_counts(make_node):
    node = make_node(aick__alpha=0.5, aick__iterations=7, frame_id='body', publish_tf=False,
                     odometry__max_speed=2, camera_in_base=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    own, core = declare_settings(node)
    assert (core.aick.alpha, core.aick.iterations, core.odometry.max_speed) == (0.5, 7, 2.0)
    assert (own.frame_id, own.publish_tf) == ('body', False)
    assert own.camera_in_base == (0, 0, 1, 0, 0, 0, 1)
    assert node.get_parameter('aick.alpha').value == 0.5


def test_an_empty_list_is_the_default(make_node):
    own, _ = declare_settings(make_node(camera_in_base=[]))
    assert own.camera_in_base == ()


def test_parameters_of_rgbd_odometry_count_where_they_mean_the_same(make_node, capfd):
    node = make_node(publish_null_when_lost=True, queue_size=7, qos=2, qos_camera_info=2,
                     subscribe_odom_info=True, always_process_most_recent_frame=False)
    own, core = declare_settings(node, {'Reg/Force3DoF': 'true', 'Icp/Iterations': '5'})
    assert (own.lost_policy, own.sync_queue_size, own.qos_reliability,
            own.process_every_frame) == ('null', 7, 'best_effort', True)
    assert node.get_parameter('lost_policy').value == 'null'
    log = capfd.readouterr()
    log = log.out + log.err
    assert "'queue_size' is read as sync_queue_size = 7" in log
    assert core.odometry.planar
    assert "'Reg/Force3DoF' is read as odometry.planar = True" in log
    assert "'Icp/Iterations' of rgbd_odometry changes nothing here" in log
    assert 'did you mean' not in log


def test_single_parameters_change_the_preset(make_node):
    _, core = declare_settings(make_node(preset='paper-full', aick__iterations=3))
    assert core == with_values(preset('paper-full'), {'aick.iterations': 3})


@pytest.mark.parametrize('overrides, sentence', [
    ({'aick__alpha': 1.5}, r'aick\.alpha = 1\.5 is outside 0 to 1'),
    ({'aick__alpha': 'high'}, "aick.alpha = 'high' is not a number"),
    ({'publish_tf': 'maybe'}, "publish_tf = 'maybe' is not true or false"),
    ({'preset': 'paper'}, "unknown preset 'paper'"),
    ({'preset': 5}, 'preset = 5 is not text'),
    ({'frame_id': ''}, 'none be empty'), ({'odom_frame_id': ''}, 'none be empty'),
    ({'frame_id': 'odom'}, 'frame_id must differ from the others'),
    ({'guess_frame_id': 'base_link'}, "guess_frame_id = 'base_link': frame_id must differ"),
    ({'camera_in_base': ['a', 'b']}, 'is not a list of numbers')])
def test_rejections_say_what_to_do(make_node, overrides, sentence):
    with pytest.raises(InputError, match=sentence):
        declare_settings(make_node(**overrides))


def test_the_names_of_frames_are_those_of_tf2(make_node):
    """Which knows none with a slash in front."""
    own, _ = declare_settings(make_node(
        frame_id='/body', odom_frame_id='/odom', guess_frame_id='//wheels'))
    assert (own.frame_id, own.odom_frame_id, own.guess_frame_id) == ('body', 'odom', 'wheels')
    with pytest.raises(InputError, match='frame_id must differ'):
        declare_settings(make_node(frame_id='/odom'))


def test_the_guess_may_be_in_the_frame_of_the_odometry(make_node):
    """As where the wheels publish odom -> base_link, and this node no TF."""
    own, _ = declare_settings(make_node(guess_frame_id='odom', publish_tf=False))
    assert own.guess_frame_id == own.odom_frame_id


def test_the_initial_pose_turns_about_x_then_y_then_z():
    """A point of the base by elementary rotations about the fixed axes."""
    T = initial_pose(NodeSettings(initial_pose=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3))).matrix
    x, y, z = 0.5, -0.7, 0.9
    y, z = y * np.cos(0.1) - z * np.sin(0.1), y * np.sin(0.1) + z * np.cos(0.1)
    x, z = x * np.cos(0.2) + z * np.sin(0.2), -x * np.sin(0.2) + z * np.cos(0.2)
    x, y = x * np.cos(0.3) - y * np.sin(0.3), x * np.sin(0.3) + y * np.cos(0.3)
    np.testing.assert_allclose(T @ (0.5, -0.7, 0.9, 1.0), (1 + x, 2 + y, 3 + z, 1.0), atol=1e-12)


def test_without_an_initial_pose_the_base_starts_at_the_origin():
    np.testing.assert_array_equal(initial_pose(NodeSettings()).matrix, np.eye(4))


@pytest.mark.parametrize('numbers', [(1.0, 2.0), (0.0,) * 7, (np.nan,) * 6])
def test_an_initial_pose_that_is_no_pose_is_rejected(numbers):
    with pytest.raises(InputError, match='x y z .m. roll pitch yaw .rad. are required'):
        initial_pose(NodeSettings(initial_pose=numbers))


@pytest.fixture
def live(make_node):
    """Parameters of a running node: what is stored, and the changes passed on."""
    class Live:
        def __init__(self):
            self.node, self.changes = make_node(), []
            self.settings = LiveSettings(*declare_settings(self.node, read_only=False))
            self.settings.begin(self.changes.append, ' is read at the start only')

        def set(self, **changes):
            return self.settings.set(
                [RosParameter(name.replace('__', '.'), value=value)
                 for name, value in changes.items()], self.node.set_parameters_atomically)

    return Live()


def test_valid_changes_are_stored_and_passed_on_as_one(live):
    assert live.set(aick__alpha=0.3, features__max_keypoints=200).successful
    assert live.node.get_parameter('aick.alpha').value == 0.3
    assert live.changes == [with_values(
        Settings(), {'aick.alpha': 0.3, 'features.max_keypoints': 200})]


def test_a_whole_number_does_for_a_real_one(live):
    assert live.set(odometry__max_speed=2).successful
    assert live.node.get_parameter('odometry.max_speed').value == 2.0
    assert live.changes[0].odometry.max_speed == 2.0


def test_a_value_that_is_set_already_is_not_passed_on(live):
    assert live.set(aick__alpha=0.6).successful
    assert live.changes == []


@pytest.mark.parametrize('changes, reason', [
    ({'odometry__max_speed': 5000.0},
     'odometry.max_speed = 5000.0 is outside 0.01 to 1000 m/s. Meaning: Maximum speed'),
    ({'aick__iterations': 0}, 'aick.iterations = 0 is outside 1 to 100'),
    ({'aick__vocabulary': '/none.npz'}, '/none.npz'),
    ({'aick__vocabulary': 'surf-1000'}, 'the vocabulary surf-1000 is of surf keypoints'),
    ({'sensor__mask': '/none.png'}, 'cannot read the mask (sensor.mask) /none.png: No such file'),
    ({'aick__alpha': 'high'}, "aick.alpha = 'high' is not a number"),
    ({'features__detector': 'orbs'}, "features.detector = 'orbs' is none of 'orb'"),
    ({'aick__alfa': 0.5}, "no parameter is called 'aick.alfa': did you mean aick.alpha"),
    ({'sensor__min_depth': 20.0}, 'the first must be less than the second'),
    ({'frame_id': 'body'}, 'frame_id is read at the start only'),
    ({'preset': 'paper-fast'}, 'preset is read at the start only')])
def test_of_a_bad_change_nothing_is_taken(live, changes, reason):
    result = live.set(aick__lambda_e=0.05, **changes)
    assert not result.successful
    assert reason in result.reason
    assert live.node.get_parameter('aick.lambda_e').value == 0.01
    assert live.changes == []


def test_changes_that_only_fit_together_are_taken_together(live):
    assert not live.set(sensor__min_depth=12.0).successful
    assert live.set(sensor__min_depth=12.0, sensor__max_depth=20.0).successful


def test_before_it_begins_everything_can_be_set(live):
    live.settings.end()
    assert live.set(frame_id='body', aick__alpha=0.5, camera_in_base=[0.0] * 6 + [1.0]).successful
    assert live.node.get_parameter('frame_id').value == 'body'
    assert (live.settings.own.frame_id, live.settings.core.aick.alpha) == ('body', 0.5)
    assert live.settings.own.camera_in_base == (0, 0, 0, 0, 0, 0, 1)
    assert not live.set(odom_frame_id='body').successful  # frames must differ
    assert live.changes == []


def test_before_it_begins_a_preset_replaces_what_was_set(live):
    live.settings.end()
    assert live.set(aick__lambda_e=0.05).successful
    assert live.set(preset='paper-full', aick__iterations=3).successful
    expected = with_values(preset('paper-full'), {'aick.iterations': 3})
    assert live.settings.core == expected
    for name in ('aick.lambda_e', 'aick.alpha', 'aick.iterations', 'refinement.mode'):
        group, _, last = name.partition('.')
        assert live.node.get_parameter(name).value == getattr(getattr(expected, group), last)


def test_parameters_of_ros_itself_are_left_to_it(live):
    assert live.set(use_sim_time=True).successful
    assert live.node.get_parameter('use_sim_time').value is True
    assert live.changes == []


def test_unknown_names_are_reported_with_the_nearest_one(make_node, capfd):
    declare_settings(make_node(aick__alhpa=0.5, frame='body', use_sim_time=False))
    log = capfd.readouterr().err
    assert "'aick.alhpa' is not one of this node and changes nothing: did you mean aick.al" in log
    assert "did you mean frame_id" in log
    assert 'use_sim_time' not in log


def test_of_many_unknown_names_only_some_are_reported(make_node, capfd):
    """Where they are 10,000, the node begins all the same, at once."""
    declare_settings(make_node(**{f'of_another_{number}': 1 for number in range(1000)}))
    log = capfd.readouterr().err
    assert 0 < log.count('is not one of this node') < 100
    named = log.count('is not one of this node')
    assert f'{1000 - named} more parameters are not of this node' in log


def test_what_is_no_range_has_none_and_lists_may_be_given_as_text(make_node):
    node = make_node()
    declare_settings(node)
    preset_ = node.describe_parameter('preset')
    assert preset_.read_only
    assert preset_.description.startswith('Start from the parameters of the paper, ')
    assert all(f'{name}' in preset_.description for name in PRESETS)
    for group in (NodeSettings, Settings):
        for parameter in parameters(group):
            descriptor = node.describe_parameter(parameter.name)
            assert descriptor.dynamic_typing is (parameter.type is tuple)
            assert bool(descriptor.additional_constraints) is bool(parameter.choices)
            assert len(descriptor.floating_point_range) == (parameter.type is float)
            assert len(descriptor.integer_range) == (parameter.type is int)
            for limits in (*descriptor.floating_point_range, *descriptor.integer_range):
                assert (limits.from_value, limits.to_value) == (
                    parameter.minimum, parameter.maximum)
            assert all(limits.step == 1 for limits in descriptor.integer_range)
            assert descriptor.description == parameter.description + (
                f' [{parameter.unit}]' if parameter.unit else '')


def test_where_nothing_is_read_only_everything_may_be_set(make_node):
    node = make_node()
    declare_settings(node, read_only=False)
    for name in ('preset', 'frame_id', 'aick.alpha'):
        assert not node.describe_parameter(name).read_only


def test_choices_are_in_the_description(make_node):
    node = make_node()
    declare_settings(node)
    constraints = node.describe_parameter('lost_policy').additional_constraints
    assert all(choice in constraints for choice in ('hold', 'null', 'silent'))


def test_the_command_line_takes_precedence(make_node):
    _, core = declare_settings(make_node(**{'Reg/Force3DoF': 'false'}), {'Reg/Force3DoF': 'true'})
    assert core.odometry.planar


def test_of_a_rejected_declaration_nothing_is_declared(make_node):
    node = make_node(aick__alpha=7.0)
    with pytest.raises(InputError):
        declare_settings(node)
    assert not node.has_parameter('frame_id')
    assert not node.has_parameter('preset')


def test_the_frames_are_named_where_they_cannot_be_connected(make_node):
    with pytest.raises(InputError) as caught:
        declare_settings(make_node(frame_id='body', guess_frame_id='body'))
    assert str(caught.value) == ("frame_id = 'body' and odom_frame_id = 'odom' and guess_frame_id "
                                 "= 'body': frame_id must differ from the others, and none be "
                                 'empty')
    with pytest.raises(InputError) as caught:
        declare_settings(make_node(odom_frame_id=''))
    assert str(caught.value).startswith("frame_id = 'base_link' and odom_frame_id = '': frame_id ")


@pytest.mark.parametrize('numbers', [(1.0, 2.0), (np.nan,) + (0.0,) * 5, (0.0,) * 5 + (np.inf,)])
def test_the_numbers_of_a_rejected_initial_pose_are_named(numbers):
    with pytest.raises(InputError) as caught:
        initial_pose(NodeSettings(initial_pose=numbers))
    assert str(caught.value) == (f'initial_pose = {list(numbers)} is no pose: x y z [m] roll '
                                 'pitch yaw [rad] are required')


@pytest.mark.parametrize('numbers', [(1e300,) + (0.0,) * 5, (0.0,) * 3 + (1e300,) + (0.0,) * 2])
def test_an_initial_pose_that_is_too_far_away_is_named(numbers):
    with pytest.raises(InputError) as caught:
        initial_pose(NodeSettings(initial_pose=numbers))
    assert str(caught.value).startswith(f'initial_pose = {list(numbers)} is not a pose: ')


def test_parameters_of_ros_are_not_taken_for_those_of_rtabmap(make_node, capfd):
    declare_settings(make_node(**{'qos_overrides./clock.subscription.depth': 5}))
    assert capfd.readouterr().err == ''


def test_an_initial_pose_is_certain():
    pose = initial_pose(NodeSettings(initial_pose=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(pose.covariance, np.zeros((6, 6)))


@pytest.mark.parametrize('name', ['aick.alpha', 'frame_id', 'preset'])
def test_a_parameter_cannot_be_deleted(live, name):
    live.settings.end()
    before = live.settings.own, live.settings.core
    result = live.set(**{name: None})
    assert not result.successful
    assert result.reason == f'{name} cannot be deleted: set it to another value'
    assert (live.settings.own, live.settings.core) == before


def test_what_ros_itself_rejects_is_not_taken(live):
    """As where a parameter is read-only for it."""
    asked = [RosParameter('aick.alpha', value=0.3)]
    result = live.settings.set(asked, lambda parameters: SetParametersResult(
        successful=False, reason='of ROS'))
    assert (result.successful, result.reason) == (False, 'of ROS')
    assert live.settings.core == Settings()
    assert live.changes == []


def test_all_that_a_change_changes_is_stored_at_once(live):
    """The others of a preset, too, and of ROS what is asked for."""
    live.settings.end()
    stored = []

    def store(parameters):
        stored.append({parameter.name: parameter.value for parameter in parameters})
        return SetParametersResult(successful=True)

    live.settings.set([RosParameter('preset', value='paper-full'),
                       RosParameter('use_sim_time', value=True)], store)
    [names] = stored
    expected, now = preset('paper-full'), values(Settings())
    changed = {name for name, value in values(expected).items() if value != now[name]}
    assert set(names) == {'preset', 'use_sim_time', *changed}
    assert live.settings.core == expected


def test_a_value_given_again_is_stored_again(live):
    """So that ROS reports it as set."""
    stored = []
    live.settings.set([RosParameter('aick.alpha', value=0.6)], lambda parameters: (
        stored.extend(parameters) or SetParametersResult(successful=True)))
    assert [(parameter.name, parameter.value) for parameter in stored] == [('aick.alpha', 0.6)]


def test_an_empty_list_is_stored_as_empty_text(live):
    live.settings.end()
    assert live.set(camera_in_base=[0.0] * 6 + [1.0]).successful
    assert list(live.node.get_parameter('camera_in_base').value) == [0.0] * 6 + [1.0]
    assert live.set(camera_in_base='').successful
    assert (live.node.get_parameter('camera_in_base').value, live.settings.own.camera_in_base) == (
        '', ())


def test_only_the_algorithms_settings_that_changed_are_passed_on(live):
    assert live.set(use_sim_time=True, aick__alpha=0.3).successful
    assert live.set(aick__alpha=0.3).successful
    assert len(live.changes) == 1
    live.settings.end()
    assert live.set(aick__alpha=0.4).successful
    assert len(live.changes) == 1
    assert live.settings.core.aick.alpha == 0.4
