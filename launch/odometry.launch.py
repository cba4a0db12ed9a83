# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Visual odometry of one RGB-D camera: ros2 launch aick_ros odometry.launch.py camera:=...."""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node

from aick_ros.ros.process.resources import fastdds_profile
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory('aick_ros'))
TOPICS = ('rgb/image', 'depth/image', 'rgb/camera_info', 'depth/camera_info')
TRUTH_VALUES = {'true': True, 'yes': True, 'on': True, '1': True,
                'false': False, 'no': False, 'off': False, '0': False}


def generate_launch_description():
    """Declare the arguments and start the node with them."""
    cameras = sorted(file.stem for file in (SHARE / 'config' / 'cameras').glob('*.yaml'))
    return LaunchDescription([
        DeclareLaunchArgument('camera', default_value='', choices=['', *cameras],
                              description='Topics and noise of a known camera'),
        DeclareLaunchArgument('namespace', default_value='',
                              description='Namespace of the node, where several run'),
        DeclareLaunchArgument('rgb_topic', default_value='',
                              description="Topic of the colour images; '': that of the camera"),
        DeclareLaunchArgument('depth_topic', default_value='',
                              description="Topic of the depth images; '': that of the camera"),
        DeclareLaunchArgument('camera_info_topic', default_value='',
                              description="Topic of the calibration; '': that of the camera"),
        DeclareLaunchArgument('depth_camera_info_topic', default_value='',
                              description='Topic of the depth calibration, for register_depth'),
        DeclareLaunchArgument('frame_id', default_value='',
                              description="Frame whose motion is published; '': from params_file"),
        DeclareLaunchArgument('odom_frame_id', default_value='',
                              description="Frame of the published pose; '': from params_file"),
        DeclareLaunchArgument('publish_tf', default_value='',
                              description="Whether to publish TF; '': from params_file"),
        DeclareLaunchArgument('camera_in_base', default_value='',
                              description='Extrinsic [x, y, z, qx, qy, qz, qw]; '
                              "'': from params_file"),
        DeclareLaunchArgument('use_sim_time', default_value='false',
                              description='Whether time comes from /clock'),
        DeclareLaunchArgument('params_file', default_value='',
                              description="Parameter file of the node; '': the defaults"),
        DeclareLaunchArgument('lifecycle', default_value='false',
                              description='Whether a manager configures and activates the node'),
        DeclareLaunchArgument('rviz', default_value='false',
                              description='Whether to show path, keypoints and matches'),
        OpaqueFunction(function=start_nodes),
    ])


def start_nodes(context):
    """Start the nodes: camera over defaults, parameter file over both, arguments over all."""
    def argument(name):
        return LaunchConfiguration(name).perform(context)

    given = dict(zip(TOPICS, map(argument, (
        'rgb_topic', 'depth_topic', 'camera_info_topic', 'depth_camera_info_topic'))))
    topics, parameters = dict.fromkeys(TOPICS, ''), [str(SHARE / 'config' / 'odom_node.yaml')]
    if argument('camera'):
        file = SHARE / 'config' / 'cameras' / f'{argument("camera")}.yaml'
        camera = yaml.safe_load(file.read_text())
        topics.update(camera['remappings'])
        if '/**' in camera:
            parameters.append(camera['/**']['ros__parameters'])
    if argument('params_file'):
        if not Path(argument('params_file')).is_file():
            raise FileNotFoundError(f'params_file:={argument("params_file")} does not exist')
        parameters.append(argument('params_file'))
    topics.update({name: topic for name, topic in given.items() if topic})
    given_parameters = {name: argument(name) for name in (
        'frame_id', 'odom_frame_id', 'camera_in_base') if argument(name)}
    if argument('publish_tf'):
        given_parameters['publish_tf'] = _truth('publish_tf', argument('publish_tf'))
    clock = {'use_sim_time': _truth('use_sim_time', argument('use_sim_time'))}
    managed = _truth('lifecycle', argument('lifecycle'))
    nodes = [Node(
        package='aick_ros', executable='odom_lifecycle_node' if managed else 'odom_node',
        output='screen',
        namespace=argument('namespace'),
        remappings=[(name, topic) for name, topic in topics.items() if topic],
        additional_env=fastdds_profile(),
        parameters=[*parameters, {**clock, **given_parameters}])]
    if _truth('rviz', argument('rviz')):
        nodes.append(Node(
            package='rviz2', executable='rviz2', namespace=argument('namespace'),
            arguments=['-d', str(SHARE / 'config' / 'odometry.rviz'),
                       '-f', argument('odom_frame_id') or 'odom'],
            parameters=[clock]))
    return nodes


def _truth(name, text):
    """Return the truth value that an argument says."""
    if text.lower() not in TRUTH_VALUES:
        raise ValueError(f'{name}:={text} is not true or false')
    return TRUTH_VALUES[text.lower()]
