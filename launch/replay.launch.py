# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odometry over a recorded bag: ros2 launch aick_ros replay.launch.py bag:=FOLDER."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument, EmitEvent, IncludeLaunchDescription, RegisterEventHandler, TimerAction)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

SHARE = Path(get_package_share_directory('aick_ros'))


def generate_launch_description():
    """Start the node and play the bag to it; the launch ends with the bag."""
    player = Node(
        package='aick_ros', executable='bag_player', output='screen',
        arguments=[LaunchConfiguration('bag'), '--rate', LaunchConfiguration('rate')],
        additional_env={'FASTRTPS_DEFAULT_PROFILES_FILE': str(SHARE / 'config' / 'fastdds.xml')})
    odometry = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SHARE / 'launch' / 'odometry.launch.py')),
        launch_arguments={
            'rgb_topic': LaunchConfiguration('rgb_topic'),
            'depth_topic': LaunchConfiguration('depth_topic'),
            'camera_info_topic': LaunchConfiguration('camera_info_topic'),
            'frame_id': LaunchConfiguration('frame_id'),
            'camera_in_base': LaunchConfiguration('camera_in_base'),
            'params_file': LaunchConfiguration('params_file'),
            'rviz': LaunchConfiguration('rviz'),
            'use_sim_time': 'true'}.items())
    return LaunchDescription([
        *_arguments(),
        odometry, player,
        RegisterEventHandler(OnProcessExit(target_action=player, on_exit=[
            TimerAction(period=2.0, actions=[  # for the last frames to be answered
                EmitEvent(event=Shutdown(reason='the bag is over'))])])),
    ])


def _arguments():
    return [
        DeclareLaunchArgument('bag', description='Folder of a ROS 2 bag'),
        DeclareLaunchArgument('rate', default_value='1.0', description='Playback rate'),
        DeclareLaunchArgument('rgb_topic', default_value='/camera/rgb/image_raw',
                              description='Topic of the colour images'),
        DeclareLaunchArgument('depth_topic', default_value='/camera/depth/image_raw',
                              description='Topic of the depth images'),
        DeclareLaunchArgument('camera_info_topic', default_value='/camera/rgb/camera_info',
                              description='Topic of the calibration'),
        DeclareLaunchArgument('frame_id', default_value='',
                              description="Frame whose motion is published; '': from params_file"),
        DeclareLaunchArgument('camera_in_base', default_value='',
                              description='Extrinsic x y z qx qy qz qw, for a bag without TF'),
        DeclareLaunchArgument('params_file', default_value='',
                              description="Parameter file of the node; '': the defaults"),
        DeclareLaunchArgument('rviz', default_value='false', choices=['true', 'false'],
                              description='Whether to show path, keypoints and matches'),
    ]
