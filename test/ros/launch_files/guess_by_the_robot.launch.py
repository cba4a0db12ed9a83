# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A robot whose own odometry is the guess: that of the camera has names of its own."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Start odometry and SLAM."""
    shared = {'frame_id': 'camera_link', 'subscribe_rgbd': True, 'subscribe_odom_info': True,
              'guess_frame_id': 'odom', 'approx_sync': False, 'use_action_for_goal': True,
              'use_sim_time': LaunchConfiguration('use_sim_time'),
              'wait_imu_to_init': LaunchConfiguration('use_imu'), 'wait_for_transform': 0.5,
              'Reg/Force3DoF': 'true', 'Grid/RangeMax': '2', 'Odom/ResetCountdown': '2'}
    remappings = [('imu', 'imu/data/filtered'), ('odom', 'vo'),
                  ('rgbd_image', '/camera/rgbd_image'), ('map', '/map')]
    namespace = LaunchConfiguration('namespace')
    return LaunchDescription([
        DeclareLaunchArgument('use_sim_time', default_value='false'),
        DeclareLaunchArgument('use_imu', default_value='true'),
        DeclareLaunchArgument('enable_vo', default_value='true'),
        DeclareLaunchArgument('namespace', default_value=''),
        Node(package='rtabmap_odom', executable='rgbd_odometry', namespace=namespace,
             condition=IfCondition(LaunchConfiguration('enable_vo')),
             parameters=[shared, {'odom_frame_id': 'vo'}], remappings=remappings,
             arguments=['--ros-args', '--log-level', 'info']),
        Node(package='rtabmap_slam', executable='rtabmap', namespace=namespace,
             parameters=[shared], remappings=remappings, arguments=['-d'])])
