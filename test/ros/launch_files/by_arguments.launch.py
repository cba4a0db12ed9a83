# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Everything by launch arguments: separate topics, or images that another node synchronises."""

from launch_ros.actions import Node

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    'frame_id': 'camera_link', 'odom_topic': 'odom', 'namespace': 'rtabmap',
    'vo_frame_id': LaunchConfiguration('odom_topic'), 'visual_odometry': 'true',
    'rgbd_sync': 'false', 'subscribe_rgbd': LaunchConfiguration('rgbd_sync'),
    'rgbd_topic': '/camera/rgbd_image', 'approx_sync': 'false',
    'approx_sync_max_interval': '0.0', 'qos': '1', 'cfg': '', 'args': '', 'odom_args': '',
    'odom_log_level': 'info', 'guess_frame_id': '', 'ground_truth_frame_id': '',
    'imu_topic': '/imu/data', 'wait_imu_to_init': 'false'}


def _nodes(context):
    odometry = {name: LaunchConfiguration(name) for name in (
        'frame_id', 'approx_sync', 'approx_sync_max_interval', 'qos', 'subscribe_rgbd',
        'wait_imu_to_init')}
    texts = {ours: LaunchConfiguration(name).perform(context) for ours, name in (
        ('config_path', 'cfg'), ('guess_frame_id', 'guess_frame_id'),
        ('ground_truth_frame_id', 'ground_truth_frame_id'))}
    remappings = [
        ('rgb/image', '/camera/color/image_raw'),
        ('rgb/camera_info', '/camera/color/camera_info'),
        ('depth/image', '/camera/aligned_depth_to_color/image_raw'),
        ('rgbd_image', LaunchConfiguration('rgbd_topic')),
        ('odom', LaunchConfiguration('odom_topic')), ('imu', LaunchConfiguration('imu_topic'))]
    return [
        Node(package='rtabmap_sync', executable='rgbd_sync', remappings=remappings,
             namespace=LaunchConfiguration('namespace'), parameters=[{'approx_sync': True}],
             condition=IfCondition(LaunchConfiguration('rgbd_sync'))),
        Node(package='rtabmap_odom', executable='rgbd_odometry', name='rgbd_odometry',
             condition=IfCondition(LaunchConfiguration('visual_odometry')),
             namespace=LaunchConfiguration('namespace'), remappings=remappings,
             parameters=[{**odometry, **texts, 'odom_frame_id': LaunchConfiguration('vo_frame_id'),
                          'publish_tf': True, 'topic_queue_size': 10, 'sync_queue_size': 10,
                          'qos_imu': 1, 'qos_camera_info': 1, 'guess_min_translation': 0.0,
                          'wait_for_transform': 0.2, 'always_check_imu_tf': True,
                          'always_process_most_recent_frame': True}],
             arguments=[LaunchConfiguration('args'), LaunchConfiguration('odom_args'),
                        '--ros-args', '--log-level',
                        [LaunchConfiguration('namespace'), '.rgbd_odometry:=',
                         LaunchConfiguration('odom_log_level')]]),
        Node(package='rtabmap_slam', executable='rtabmap', remappings=remappings,
             namespace=LaunchConfiguration('namespace'), arguments=[LaunchConfiguration('args')],
             parameters=[{'subscribe_rgbd': LaunchConfiguration('subscribe_rgbd'),
                          'subscribe_odom_info': True}])]


def generate_launch_description():
    """Start synchronisation, odometry and SLAM in a namespace."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value) for name, value in ARGUMENTS.items()),
        OpaqueFunction(function=_nodes)])
