# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Several cameras in one message; SLAM receives their data from the odometry."""

from launch_ros.actions import Node, SetParameter

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration


def _nodes(context):
    has_imu = LaunchConfiguration('use_imu').perform(context) == 'true'
    slam = {'parameters': [{'frame_id': 'camera_link', 'subscribe_sensor_data': True,
                            'approx_sync': False, 'subscribe_odom_info': True}],
            'remappings': [('sensor_data', 'odom_sensor_data/raw')], 'namespace': 'rtabmap'}
    return [
        Node(package='rtabmap_odom', executable='rgbd_odometry', namespace='rtabmap',
             parameters=[{'frame_id': 'camera_link', 'rgbd_cameras': 0, 'subscribe_rgbd': True,
                          'wait_imu_to_init': has_imu}],
             remappings=[('imu', '/imu')] if has_imu else []),
        Node(package='rtabmap_slam', executable='rtabmap', **slam),
        Node(package='rtabmap_viz', executable='rtabmap_viz', **slam)]


def generate_launch_description():
    """Start odometry, SLAM and viewer for a bag."""
    return LaunchDescription([
        DeclareLaunchArgument('use_imu', default_value='false'),
        SetParameter(name='use_sim_time', value=True), OpaqueFunction(function=_nodes)])
