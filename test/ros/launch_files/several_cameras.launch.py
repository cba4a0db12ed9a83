# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Several cameras, each synchronised by itself; the odometry has the first one or all of them."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Start odometry and SLAM."""
    cameras = [('rgbd_image0', '/camera/rgbd_image'), ('rgbd_image1', '/camera2/rgbd_image')]
    shared = {'frame_id': 'camera_link', 'subscribe_rgbd': True, 'approx_sync': True,
              'publish_tf': True}
    all_of_them = LaunchConfiguration('all_of_them')
    return LaunchDescription([
        DeclareLaunchArgument('all_of_them', default_value='false'),
        DeclareLaunchArgument('args', default_value=''),
        Node(package='rtabmap_odom', executable='rgbd_odometry', namespace='rtabmap',
             condition=UnlessCondition(all_of_them),
             parameters=[{**shared, 'odom_frame_id': 'odom'}],
             remappings=[('rgbd_image', '/camera/rgbd_image'), ('odom', 'odom')],
             arguments=[LaunchConfiguration('args'), '']),
        Node(package='rtabmap_odom', executable='rgbd_odometry', namespace='rtabmap',
             condition=IfCondition(all_of_them),
             parameters=[{**shared, 'rgbd_cameras': 2, 'sync_queue_size': 30}],
             remappings=cameras),
        Node(package='rtabmap_slam', executable='rtabmap', namespace='rtabmap',
             parameters=[{**shared, 'rgbd_cameras': 2, 'subscribe_odom_info': True,
                          'Mem/IncrementalMemory': 'true'}],
             remappings=cameras, arguments=['--delete_db_on_start'])])
