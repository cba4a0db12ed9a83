# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images that are synchronised once, arguments of the algorithm, names and QoS by arguments."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """Start synchronisation, odometry and SLAM in a namespace."""
    synchronised = [('rgbd_image', LaunchConfiguration('rgbd_topic')), ('odom', 'odom')]
    return LaunchDescription([
        DeclareLaunchArgument('frame_id', default_value='camera_link'),
        DeclareLaunchArgument('rgbd_topic', default_value='/camera/rgbd_image'),
        DeclareLaunchArgument('approx_sync_max_interval', default_value='0.0'),
        DeclareLaunchArgument('qos', default_value='1'),
        DeclareLaunchArgument('args', default_value='--delete_db_on_start'),
        DeclareLaunchArgument('odom_args',
                              default_value='--Odom/ResetCountdown 1 --Vis/MinInliers 15'),
        Node(package='rtabmap_sync', executable='rgbd_sync', namespace='rtabmap',
             parameters=[{'approx_sync': True}], remappings=synchronised),
        Node(package='rtabmap_odom', executable='rgbd_odometry', name='rgbd_odometry',
             namespace='rtabmap', remappings=synchronised, parameters=[{
                 'frame_id': LaunchConfiguration('frame_id'), 'odom_frame_id': 'odom',
                 'subscribe_rgbd': True, 'subscribe_odom_info': True, 'approx_sync': True,
                 'approx_sync_max_interval': LaunchConfiguration('approx_sync_max_interval'),
                 'publish_tf': True, 'publish_null_when_lost': True, 'queue_size': 10,
                 'qos': LaunchConfiguration('qos'), 'qos_imu': 1, 'topic_queue_size': 10,
                 'ground_truth_frame_id': '', 'ground_truth_base_frame_id': '',
                 'guess_min_translation': 0.0, 'wait_for_transform': 0.2}],
             arguments=[LaunchConfiguration('odom_args')]),
        Node(package='rtabmap_slam', executable='rtabmap', namespace='rtabmap',
             remappings=synchronised, arguments=[LaunchConfiguration('args')],
             parameters=[{'subscribe_rgbd': True, 'subscribe_odom_info': True}])])
