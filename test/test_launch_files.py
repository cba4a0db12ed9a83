# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the launch files start; the package index has no launch, so a stand-in records it."""

import json
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from ament_index_python import packages

from aick_ros.settings import NodeSettings, Settings
from aick_ros.settings.parameter import values, with_values

ROOT = Path(__file__).parents[1]
NAMES = {
    'launch': ['LaunchDescription'],
    'launch.actions': ['DeclareLaunchArgument', 'EmitEvent', 'IncludeLaunchDescription',
                       'OpaqueFunction', 'RegisterEventHandler', 'TimerAction'],
    'launch.event_handlers': ['OnProcessExit'], 'launch.events': ['Shutdown'],
    'launch.launch_description_sources': ['PythonLaunchDescriptionSource'],
    'launch.substitutions': ['LaunchConfiguration'], 'launch_ros': [],
    'launch_ros.actions': ['Node']}


def recorder(kind):
    """Return a class whose instances are what they were made with."""
    class Recorded(SimpleNamespace):
        def __init__(self, *positional, **named):
            super().__init__(kind=kind, positional=positional, **named)

        def perform(self, context):
            return context[self.positional[0]]
    return Recorded


@pytest.fixture
def launch(monkeypatch):
    """Run a launch file with arguments; return the nodes it starts."""
    for module, names in NAMES.items():
        stand_in = ModuleType(module)
        for name in names:
            setattr(stand_in, name, recorder(name))
        monkeypatch.setitem(sys.modules, module, stand_in)
    monkeypatch.setattr(packages, 'get_package_share_directory', lambda name: str(ROOT))

    arguments = []

    def run(file, context):
        description = runpy.run_path(str(file))['generate_launch_description']()
        actions, context = list(description.positional[0]), dict(context)
        while actions:
            action = actions.pop(0)
            if action.kind == 'DeclareLaunchArgument':
                arguments.append(action)
                context.setdefault(action.positional[0], getattr(action, 'default_value', ''))
            elif action.kind == 'OpaqueFunction':
                actions = [*action.function(context), *actions]
            elif action.kind == 'IncludeLaunchDescription':
                included = action.positional[0].positional[0]
                yield from run(included, {**context, **dict(action.launch_arguments)})
            elif action.kind == 'Node':
                yield action

    def start(name, **given):
        return {node.executable: node for node in run(ROOT / 'launch' / name, given)}
    start.arguments = arguments
    return start


def parameters(node):
    """Return the parameters of the node beside the defaults, the later ones over the earlier."""
    merged = {}
    for group in node.parameters[1:]:
        merged.update(group if isinstance(group, dict) else
                      yaml.safe_load(Path(group).read_text())['/**']['ros__parameters'])
    return merged


SHOW = """
import json, sys
import rclpy
from rclpy.node import Node
rclpy.init(args=sys.argv)
node = Node('node', automatically_declare_parameters_from_overrides=True)
print(json.dumps({name: one.value for name, one in node.get_parameters_by_prefix('').items()}))
"""


def parameters_in_ros(node, folder):
    """Return the parameters that rclpy gives a node which is started as launch_ros does."""
    words = ['--ros-args', '-r', f'__node:={node.name}']
    if node.namespace:
        words += ['-r', f'__ns:=/{node.namespace}']
    for number, group in enumerate(node.parameters):
        if isinstance(group, dict):
            file = folder / f'{number}.yaml'
            of_node = '/'.join(['', *filter(None, [node.namespace]), node.name])
            file.write_text(yaml.safe_dump({of_node: {'ros__parameters': group}}))
            group = file
        words += ['--params-file', str(group)]
    shown = subprocess.run([sys.executable, '-c', SHOW, *words], capture_output=True, text=True,
                           check=True, timeout=60)
    return json.loads(shown.stdout)


def topics_of(camera):
    file = ROOT / 'config' / 'cameras' / f'{camera}.yaml'
    return yaml.safe_load(file.read_text())['remappings']


def test_the_extrinsic_may_be_given_as_the_list_it_is(launch):
    node = launch('odometry.launch.py',
                  camera_in_base='[0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5]')['odom_node']
    given = {'camera_in_base': parameters(node)['camera_in_base']}
    assert with_values(NodeSettings(), given).camera_in_base == (
        0.1, 0.0, 0.3, -0.5, 0.5, -0.5, 0.5)


def test_the_numbers_of_a_list_need_no_point(launch, tmp_path):
    """ROS reads no list of which some are whole: -p rejects it, launch_ros with a traceback."""
    node = launch('odometry.launch.py', camera_in_base='[0, 0, 0.3, 0, 0, 0, 1]')['odom_node']
    found = parameters_in_ros(node, tmp_path)['camera_in_base']
    assert found == [0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize('text, expected', [
    ('true', True), ('True', True), ('yes', True), ('1', True), ('on', True),
    ('false', False), ('no', False), ('0', False), ('off', False)])
def test_truth_values(launch, text, expected):
    nodes = launch('odometry.launch.py', publish_tf=text, use_sim_time=text, rviz=text)
    given = parameters(nodes['odom_node'])
    assert (given['publish_tf'], given['use_sim_time']) == (expected, expected)
    assert ('rviz2' in nodes) == expected


def test_the_profile_of_fast_dds_is_that_of_the_package_unless_one_is_set(launch, monkeypatch):
    for variable in ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'):
        monkeypatch.delenv(variable, raising=False)
    [profile] = launch('odometry.launch.py')['odom_node'].additional_env.values()
    assert Path(profile) == ROOT / 'config' / 'fastdds.xml'
    monkeypatch.setenv('FASTDDS_DEFAULT_PROFILES_FILE', '/mine.xml')
    assert launch('odometry.launch.py')['odom_node'].additional_env == {}


def test_the_node_for_a_manager_is_started_like_the_other_one(launch):
    one = launch('odometry.launch.py', camera='orbbec')['odom_node']
    other = launch('odometry.launch.py', camera='orbbec', lifecycle='true')['odom_lifecycle_node']
    assert (other.parameters, other.remappings) == (one.parameters, one.remappings)


@pytest.mark.parametrize('name', ['publish_tf', 'use_sim_time', 'rviz', 'lifecycle'])
def test_what_is_no_truth_value_is_rejected(launch, name):
    with pytest.raises(ValueError, match=f'{name}:=maybe is not true or false'):
        launch('odometry.launch.py', **{name: 'maybe'})


def test_a_parameter_file_that_is_missing_is_named(launch):
    with pytest.raises(FileNotFoundError, match='params_file:=/none.yaml does not exist'):
        launch('odometry.launch.py', params_file='/none.yaml')


def test_a_parameter_file_may_be_in_the_home_folder(launch, tmp_path, monkeypatch):
    """As no shell fills in ~ behind :=."""
    monkeypatch.setenv('HOME', str(tmp_path))
    (tmp_path / 'mine.yaml').write_text('')
    node = launch('odometry.launch.py', params_file='~/mine.yaml')['odom_node']
    assert node.parameters[1] == str(tmp_path / 'mine.yaml')


def test_a_parameter_file_comes_after_the_defaults(launch, tmp_path):
    file = tmp_path / 'parameters.yaml'
    file.touch()
    node = launch('odometry.launch.py', params_file=str(file))['odom_node']
    assert node.parameters[:2] == [str(ROOT / 'config' / 'odom_node.yaml'), str(file)]


@pytest.mark.parametrize('namespace', ['', 'front'])
@pytest.mark.parametrize('section', ['/**', 'odom_node', '/**/odom_node'])
def test_arguments_win_over_a_parameter_file_and_that_over_the_camera(
        launch, tmp_path, namespace, section):
    """Whatever the file calls the node: a dump of its parameters has the name."""
    if section == 'odom_node' and namespace:
        section = f'/{namespace}/odom_node'
    file = tmp_path / 'mine.yaml'
    file.write_text(yaml.safe_dump({section: {'ros__parameters': {
        'publish_tf': True, 'frame_id': 'of_file', 'use_sim_time': True,
        'sensor': {'depth_sigma': 0.25}}}}))
    node = launch('odometry.launch.py', camera='realsense_d400', params_file=str(file),
                  namespace=namespace, publish_tf='false', frame_id='given')['odom_node']
    found = parameters_in_ros(node, tmp_path)
    assert (found['publish_tf'], found['frame_id'], found['use_sim_time']) == (
        False, 'given', False)
    assert (found['sensor.depth_sigma'], found['sensor.depth_exponent']) == (0.25, 2.0)


def test_every_parameter_of_the_node_is_an_argument(launch):
    given = {'register_depth': 'true', 'image_transport': 'compressed', 'preset': 'embedded',
             'odometry.planar': 'true', 'odometry.planar_sigma': '0.01', 'twist_covariance':
             'increment'}
    node = launch('odometry.launch.py', **given)['odom_node']
    found = {name: value for name, value in parameters(node).items() if name != 'use_sim_time'}
    assert found == {**given, 'register_depth': True, 'odometry.planar': True}
    names = {action.positional[0] for action in launch.arguments}
    assert {'preset', *values(NodeSettings), *values(Settings)} <= names


def test_other_sensors_have_topics_too(launch):
    node = launch('odometry.launch.py', camera='orbbec', imu_topic='/imu/data',
                  rgbd_image_topic='/rgbd')['odom_node']
    assert dict(node.remappings) == {
        **topics_of('orbbec'), 'imu': '/imu/data', 'rgbd_image': '/rgbd'}


def test_a_replay_has_the_topics_of_its_camera(launch):
    nodes = launch('replay.launch.py', bag='bag', camera='realsense_d400')
    assert dict(nodes['odom_node'].remappings) == topics_of('realsense_d400')
    assert parameters(nodes['odom_node'])['sensor.depth_exponent'] == 2.0
    assert 'bag_player' in nodes


def test_a_replay_without_a_camera_has_those_of_tum(launch):
    node = launch('replay.launch.py', bag='bag', depth_topic='/depth')['odom_node']
    assert dict(node.remappings) == {
        'rgb/image': '/camera/rgb/image_raw', 'depth/image': '/depth',
        'rgb/camera_info': '/camera/rgb/camera_info'}


@pytest.mark.parametrize('given, expected', [({}, True), ({'use_sim_time': 'false'}, False)])
def test_the_time_of_a_replay_can_be_chosen(launch, given, expected):
    node = launch('replay.launch.py', bag='bag', **given)['odom_node']
    assert parameters(node)['use_sim_time'] is expected
