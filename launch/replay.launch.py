# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odometry over a recorded bag: ros2 launch aick_ros replay.launch.py bag:=FOLDER."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument, EmitEvent, IncludeLaunchDescription, OpaqueFunction,
    RegisterEventHandler, TimerAction)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory('aick_ros'))
PASSED_ON = ('camera', 'rgb_topic', 'depth_topic', 'camera_info_topic', 'frame_id',
             'camera_in_base', 'params_file', 'rviz', 'use_sim_time')
TOPICS_OF_TUM = {'rgb_topic': '/camera/rgb/image_raw', 'depth_topic': '/camera/depth/image_raw',
                 'camera_info_topic': '/camera/rgb/camera_info'}


def generate_launch_description():
    """Start the node and play the bag to it; the launch ends with the bag."""
    player = Node(
        package='aick_ros', executable='bag_player', output='screen',
        arguments=[LaunchConfiguration('bag'), '--rate', LaunchConfiguration('rate')])
    return LaunchDescription([
        *_arguments(),
        OpaqueFunction(function=start_odometry), player,
        RegisterEventHandler(OnProcessExit(target_action=player, on_exit=[
            TimerAction(period=2.0, actions=[  # for the last frames to be answered
                EmitEvent(event=Shutdown(reason='the bag is over'))])])),
    ])


def start_odometry(context):
    """Start the node with the topics given, those of the camera, or those of TUM's bags."""
    given = {name: LaunchConfiguration(name).perform(context) for name in PASSED_ON}
    if not given['camera']:
        given.update({name: given[name] or topic for name, topic in TOPICS_OF_TUM.items()})
    return [IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SHARE / 'launch' / 'odometry.launch.py')),
        launch_arguments=given.items())]


def _arguments():
    return [
        DeclareLaunchArgument('bag', description='Folder of a ROS 2 bag'),
        DeclareLaunchArgument('rate', default_value='1.0', description='Playback rate'),
        DeclareLaunchArgument('camera', default_value='',
                              description="Topics and noise of a known camera; '': TUM's bags"),
        DeclareLaunchArgument('use_sim_time', default_value='true',
                              description='Whether time comes from /clock'),
        DeclareLaunchArgument('rgb_topic', default_value='',
                              description="Topic of the colour images; '': that of the camera"),
        DeclareLaunchArgument('depth_topic', default_value='',
                              description="Topic of the depth images; '': that of the camera"),
        DeclareLaunchArgument('camera_info_topic', default_value='',
                              description="Topic of the calibration; '': that of the camera"),
        DeclareLaunchArgument('frame_id', default_value='',
                              description="Frame whose motion is published; '': from params_file"),
        DeclareLaunchArgument('camera_in_base', default_value='',
                              description='Extrinsic [x, y, z, qx, qy, qz, qw], for a bag '
                              'without TF'),
        DeclareLaunchArgument('params_file', default_value='',
                              description="Parameter file of the node; '': the defaults"),
        DeclareLaunchArgument('rviz', default_value='false',
                              description='Whether to show path, keypoints and matches'),
    ]
