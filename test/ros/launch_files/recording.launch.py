# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A recording: the time is that of the bag, and RTAB-Map's own parameters are all text."""

from launch_ros.actions import Node, SetParameter

from launch import LaunchDescription


def generate_launch_description():
    """Start odometry and SLAM."""
    parameters = [{
        'frame_id': 'camera_link', 'subscribe_depth': True, 'subscribe_odom_info': True,
        'Odom/Strategy': '0', 'Odom/ResetCountdown': '15', 'RGBD/CreateOccupancyGrid': 'false',
        'Rtabmap/StartNewMapOnLoopClosure': 'true'}]
    remappings = [
        ('rgb/image', '/camera/color/image_raw'),
        ('rgb/camera_info', '/camera/color/camera_info'),
        ('depth/image', '/camera/aligned_depth_to_color/image_raw')]
    return LaunchDescription([
        SetParameter(name='use_sim_time', value=True),
        Node(package='rtabmap_odom', executable='rgbd_odometry', parameters=parameters,
             remappings=remappings),
        Node(package='rtabmap_slam', executable='rtabmap', parameters=parameters,
             remappings=remappings, arguments=['-d'])])
