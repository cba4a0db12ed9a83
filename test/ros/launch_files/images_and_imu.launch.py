# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera with separate topics and an IMU; all nodes share their parameters."""

from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description():
    """Start odometry, SLAM and viewer."""
    parameters = [{
        'frame_id': 'camera_link', 'subscribe_depth': True, 'subscribe_odom_info': True,
        'approx_sync': False, 'wait_imu_to_init': True}]
    remappings = [
        ('imu', '/imu/data'), ('rgb/image', '/camera/color/image_raw'),
        ('rgb/camera_info', '/camera/color/camera_info'),
        ('depth/image', '/camera/aligned_depth_to_color/image_raw')]
    return LaunchDescription([
        Node(package='rtabmap_odom', executable='rgbd_odometry', output='screen',
             parameters=parameters, remappings=remappings),
        Node(package='rtabmap_slam', executable='rtabmap', output='screen',
             parameters=parameters, remappings=remappings, arguments=['-d']),
        Node(package='rtabmap_viz', executable='rtabmap_viz', output='screen',
             parameters=parameters, remappings=remappings)])
