# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera with separate topics and an IMU; arguments for all nodes and for the odometry."""

from launch_ros.actions import Node, SetParameter

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Start odometry, SLAM and viewer."""
    parameters = [{
        'frame_id': 'camera_link', 'subscribe_depth': True, 'subscribe_odom_info': True,
        'approx_sync': False, 'wait_imu_to_init': True}]
    remappings = [
        ('imu', '/imu/data'), ('rgb/image', LaunchConfiguration('image')),
        ('rgb/camera_info', '/camera/color/camera_info'),
        ('depth/image', '/camera/aligned_depth_to_color/image_raw')]
    return LaunchDescription([
        SetParameter(name='depth_module.emitter_enabled', value=1),
        DeclareLaunchArgument('image', default_value='/camera/color/image_raw'),
        DeclareLaunchArgument('args', default_value=''),
        DeclareLaunchArgument('odom_args', default_value=''),
        Node(package='rtabmap_odom', executable='rgbd_odometry', output='screen',
             parameters=parameters, remappings=remappings,
             arguments=[LaunchConfiguration('args'), LaunchConfiguration('odom_args')]),
        Node(package='rtabmap_slam', executable='rtabmap', output='screen',
             parameters=parameters, remappings=remappings,
             arguments=['-d', LaunchConfiguration('args')]),
        Node(package='rtabmap_viz', executable='rtabmap_viz', output='screen',
             parameters=parameters, remappings=remappings)])
