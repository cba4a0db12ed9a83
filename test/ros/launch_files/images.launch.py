# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera with separate topics; the nodes share their parameters, and a namespace if any."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Start odometry, SLAM and viewer."""
    shared = {
        'namespace': LaunchConfiguration('namespace'),
        'parameters': [{
            'frame_id': 'camera_link', 'subscribe_depth': True, 'subscribe_odom_info': True,
            'approx_sync': LaunchConfiguration('approx_sync')}],
        'remappings': [
            ('rgb/image', '/camera/color/image_raw'),
            ('rgb/camera_info', '/camera/color/camera_info'),
            ('depth/image', '/camera/aligned_depth_to_color/image_raw')]}
    return LaunchDescription([
        DeclareLaunchArgument('namespace', default_value=''),
        DeclareLaunchArgument('approx_sync', default_value='true'),
        Node(package='rtabmap_odom', executable='rgbd_odometry', **shared),
        Node(package='rtabmap_slam', executable='rtabmap', arguments=['-d'], **shared),
        Node(package='rtabmap_viz', executable='rtabmap_viz', **shared)])
