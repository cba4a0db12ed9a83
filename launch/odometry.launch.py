# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Visual odometry of one RGB-D camera: ros2 launch aick_ros odometry.launch.py camera:=...."""

import atexit
import os
from pathlib import Path
from tempfile import NamedTemporaryFile

import yaml
from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node

from aick_ros.ros.process.resources import fastdds_profile
from aick_ros.settings import NodeSettings, Settings
from aick_ros.settings.parameter import parameters
from aick_ros.settings.presets import PRESET
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory('aick_ros'))
TOPICS = {
    'rgb_topic': ('rgb/image', 'colour images'), 'depth_topic': ('depth/image', 'depth images'),
    'camera_info_topic': ('rgb/camera_info', 'calibration'),
    'depth_camera_info_topic': ('depth/camera_info', 'depth calibration, for register_depth'),
    'rgbd_image_topic': ('rgbd_image', 'RGB-D images, for subscribe_rgbd'),
    'imu_topic': ('imu', 'IMU')}
PARAMETERS = {parameter.name: parameter for parameter in (
    PRESET, *parameters(NodeSettings), *parameters(Settings))}
TRUTH_VALUES = {'true': True, 'yes': True, 'on': True, '1': True,
                'false': False, 'no': False, 'off': False, '0': False}


def generate_launch_description():
    """Declare the arguments, each parameter of the node among them, and start it with them."""
    cameras = sorted(file.stem for file in (SHARE / 'config' / 'cameras').glob('*.yaml'))
    return LaunchDescription([
        DeclareLaunchArgument('camera', default_value='', choices=['', *cameras],
                              description='Topics and noise of a known camera'),
        DeclareLaunchArgument('namespace', default_value='',
                              description='Namespace of the node, where several run'),
        *(DeclareLaunchArgument(name, default_value='',
                                description=f"Topic of the {what}; '': that of the camera")
          for name, (_, what) in TOPICS.items()),
        DeclareLaunchArgument('use_sim_time', default_value='false',
                              description='Whether time comes from /clock'),
        DeclareLaunchArgument('params_file', default_value='',
                              description="Parameter file of the node; '': the defaults"),
        DeclareLaunchArgument('lifecycle', default_value='false',
                              description='Whether a manager configures and activates the node'),
        DeclareLaunchArgument('rviz', default_value='false',
                              description='Whether to show path, keypoints and matches, in the '
                              'frame odom_frame_id:= or odom'),
        *(DeclareLaunchArgument(name, default_value='', description=(
            f"{parameter.description} '': from params_file, or {parameter.default!r}"))
          for name, parameter in PARAMETERS.items()),
        OpaqueFunction(function=start_nodes),
    ])


def start_nodes(context):
    """Start the nodes: camera over defaults, parameter file over both, arguments over all."""
    def argument(name):
        return LaunchConfiguration(name).perform(context)

    topics, files = {}, [str(SHARE / 'config' / 'odom_node.yaml')]
    if argument('camera'):
        file = SHARE / 'config' / 'cameras' / f'{argument("camera")}.yaml'
        camera = yaml.safe_load(file.read_text())
        topics.update(camera.pop('remappings'))
        if camera:
            files.append(_written(camera))
    if argument('params_file'):
        file = os.path.expanduser(argument('params_file'))  # behind := no shell fills in ~
        if not Path(file).is_file():
            raise FileNotFoundError(f'params_file:={file} does not exist')
        files.append(file)
    topics.update({name: argument(topic) for topic, (name, _) in TOPICS.items()
                   if argument(topic)})
    given = {name: _value(name, argument(name)) for name in PARAMETERS if argument(name)}
    clock = {'use_sim_time': _truth('use_sim_time', argument('use_sim_time'))}
    managed = _truth('lifecycle', argument('lifecycle'))
    # arguments are parameters of a node of this name: as /** they would lose to a file with it
    nodes = [Node(
        package='aick_ros', executable='odom_lifecycle_node' if managed else 'odom_node',
        name='odom_node', output='screen',
        namespace=argument('namespace'), remappings=list(topics.items()),
        additional_env=fastdds_profile(), parameters=[*files, {**clock, **given}])]
    if _truth('rviz', argument('rviz')):
        nodes.append(Node(
            package='rviz2', executable='rviz2', namespace=argument('namespace'),
            arguments=['-d', str(SHARE / 'config' / 'odometry.rviz'),
                       '-f', argument('odom_frame_id') or 'odom'],
            parameters=[clock]))
    return nodes


def _written(parameters_of_nodes):
    """Write a parameter file and return its path; values would be those of the node's name."""
    with NamedTemporaryFile('w', prefix='aick_ros_', suffix='.yaml', delete=False) as file:
        yaml.safe_dump(parameters_of_nodes, file)
    atexit.register(Path(file.name).unlink, missing_ok=True)
    return file.name


def _value(name, text):
    """Return the value of a parameter; launch_ros reads text, but no list of 0 and 0.5."""
    if PARAMETERS[name].type is bool:
        return _truth(name, text)
    numbers = yaml.safe_load(text) if PARAMETERS[name].type is tuple else None
    if isinstance(numbers, list) and all(type(number) in (int, float) for number in numbers):
        return [float(number) for number in numbers]
    return text


def _truth(name, text):
    """Return the truth value that an argument says."""
    if text.lower() not in TRUTH_VALUES:
        raise ValueError(f'{name}:={text} is not true or false')
    return TRUTH_VALUES[text.lower()]
