# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two cameras, each synchronised by itself."""

from launch_ros.actions import Node

from launch import LaunchDescription


def generate_launch_description():
    """Start odometry and viewer."""
    parameters = [{'frame_id': 'camera_link', 'subscribe_rgbd': True, 'rgbd_cameras': 2,
                   'subscribe_odom_info': True, 'approx_sync': True, 'sync_queue_size': 30},
                  {'Odom/Strategy': '0', 'Reg/Force3DoF': 'true'}]
    remappings = [('rgbd_image0', '/camera/rgbd_image'), ('rgbd_image1', '/camera2/rgbd_image')]
    return LaunchDescription([
        Node(package='rtabmap_odom', executable='rgbd_odometry', name='rgbd_odometry',
             parameters=parameters, remappings=remappings),
        Node(package='rtabmap_viz', executable='rtabmap_viz',
             parameters=parameters, remappings=remappings)])
