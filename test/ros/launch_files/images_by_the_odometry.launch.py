# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SLAM receives the images from the odometry, which alone subscribes to the camera."""

from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description():
    """Start odometry, SLAM and viewer."""
    slam = {'frame_id': 'camera_link', 'subscribe_rgbd': True, 'subscribe_odom_info': True,
            'qos': 1}
    odometry = {'frame_id': 'camera_link', 'subscribe_odom_info': True, 'qos': 1,
                'approx_sync': True, 'approx_sync_max_interval': 0.01, 'queue_size': 30,
                'wait_imu_to_init': True, 'keep_color': True,
                'Rtabmap/ImagesAlreadyRectified': 'False'}
    remappings = [
        ('imu', '/imu/data'), ('rgbd_image', 'odom_rgbd_image'),
        ('rgb/image', '/camera/color/image_raw'),
        ('rgb/camera_info', '/camera/color/camera_info'),
        ('depth/image', '/camera/aligned_depth_to_color/image_raw')]
    return LaunchDescription([
        Node(package='rtabmap_odom', executable='rgbd_odometry', parameters=[odometry],
             remappings=remappings),
        Node(package='rtabmap_slam', executable='rtabmap', parameters=[slam],
             remappings=remappings, arguments=['-d']),
        Node(package='rtabmap_viz', executable='rtabmap_viz', parameters=[slam],
             remappings=remappings)])
