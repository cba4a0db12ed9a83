# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Another node synchronises the images of a camera; the remapping of the IMU is shared."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import UnlessCondition
from launch.substitutions import LaunchConfiguration


def _nodes(context):
    parameters = [{'frame_id': 'camera_link', 'subscribe_rgbd': True, 'approx_sync': False}]
    if LaunchConfiguration('wait_imu').perform(context) == 'true':
        parameters[0]['wait_imu_to_init'] = True
    remappings = [('imu', '/imu/data'), ('rgbd_image', '/camera/rgbd_image')]
    if LaunchConfiguration('use_camera_odometry').perform(context) == 'false':
        parameters.append({'subscribe_odom_info': True})
    return [
        Node(package='rtabmap_sync', executable='rgbd_sync', parameters=parameters, remappings=[
            ('rgb/image', '/camera/image'), ('rgb/camera_info', '/camera/camera_info'),
            ('depth/image', '/camera/depth'), remappings[1]]),
        Node(package='rtabmap_odom', executable='rgbd_odometry', parameters=parameters,
             remappings=remappings,
             condition=UnlessCondition(LaunchConfiguration('use_camera_odometry'))),
        Node(package='rtabmap_slam', executable='rtabmap', parameters=parameters,
             remappings=remappings, arguments=['-d'])]


def generate_launch_description():
    """Start synchronisation, odometry and SLAM."""
    return LaunchDescription([
        DeclareLaunchArgument('wait_imu', default_value='true'),
        DeclareLaunchArgument('use_camera_odometry', default_value='false'),
        OpaqueFunction(function=_nodes)])
