# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters that only the ROS node has, beside those of the algorithm."""

from __future__ import annotations

from dataclasses import dataclass

from aick_ros.settings.parameter import Checked, parameter


@dataclass(frozen=True)
class NodeSettings(Checked):
    """Settings of the ROS node."""

    frame_id: str = parameter(
        'base_link', 'Frame whose motion is published (REP-105).')
    odom_frame_id: str = parameter('odom', 'Frame of the published pose (REP-105).')
    publish_tf: bool = parameter(
        True, 'Whether to publish odom_frame_id -> frame_id on /tf.')
    camera_in_base: tuple[float, ...] = parameter(
        (), 'Pose of the optical frame of the camera in frame_id: x y z qx qy qz qw; empty: from '
        'TF.')
    initial_pose: tuple[float, ...] = parameter(
        (), 'Initial pose of frame_id in odom_frame_id: x y z [m] roll pitch yaw [rad]; empty: '
        'the pose in guess_frame_id, or the origin. With an accelerometer roll and pitch are '
        'those of gravity.')
    guess_frame_id: str = parameter(
        '', 'Odometry frame of another source, for example wheel odometry, whose transform to '
        'frame_id is the initial pose, measures the motion with the noise of odometry.guess_slip, '
        'and predicts it while tracking is lost; '
        'odom_frame_id -> guess_frame_id is then published on /tf instead. Empty: none.')
    lost_policy: str = parameter(
        'hold', 'Output while tracking is lost: the last pose with a very large covariance, a '
        'null pose (zero quaternion), or none.', choices=('hold', 'null', 'silent'))
    twist_covariance: str = parameter(
        'velocity', 'Covariance of the twist: of the velocity, as nav_msgs/Odometry defines it, '
        'or of the increment since the last frame, as RTAB-Map reads it.',
        choices=('velocity', 'increment'))
    wait_for_transform: float = parameter(
        0.1, 'Longest wait for /tf to reach the image stamp.',
        unit='s', minimum=0.0, maximum=10.0)
    wait_imu_to_init: bool = parameter(
        False, 'Whether the first frame waits for the IMU, so that odom begins level.')
    wait_level_to_init: bool = parameter(
        False, 'Whether nothing is published until what is up is known to imu.level_sigma, for '
        'imu.level_wait at most, so that odom begins level although the camera moves.')
    approx_sync: bool = parameter(
        True, 'Whether the stamps of a colour and a depth image of one frame may differ.')
    approx_sync_max_interval: float = parameter(
        0.02, 'Maximum difference between the stamps of a colour and a depth image of one frame; '
        '0: no limit.',
        unit='s', minimum=0.0, maximum=1.0)
    topic_queue_size: int = parameter(
        4, 'Queue size of each image subscription: each place outlasts a stall of one frame, and '
        'keeps the memory of an image.', minimum=1, maximum=1000)
    sync_queue_size: int = parameter(
        5, 'Maximum number of images per topic that wait for their partner.',
        minimum=1, maximum=1000)
    qos_reliability: str = parameter(
        'auto', 'QoS reliability of the image subscriptions; auto: as the publishers offer.',
        choices=('auto', 'reliable', 'best_effort'))
    image_transport: str = parameter(
        'raw', 'Transport of the colour images: raw from rgb/image, compressed from '
        'rgb/image/compressed.', choices=('raw', 'compressed'))
    depth_transport: str = parameter(
        'raw', 'Transport of the depth images: raw from depth/image, the others from '
        'depth/image/compressed (PNG) or depth/image/compressedDepth (PNG or RVL).',
        choices=('raw', 'compressed', 'compressedDepth'))
    subscribe_rgbd: bool = parameter(
        False, 'Whether colour, depth and calibration come in one message, on rgbd_image, as '
        'rgbd_sync of RTAB-Map sends them; requires rtabmap_msgs.')
    rgbd_cameras: int = parameter(
        1, 'Number of cameras with subscribe_rgbd: 1: rgbd_image; 0: rgbd_images, which has any '
        'number; more: the first one, rgbd_image0, is used.', minimum=0, maximum=6)
    image_rectification: str = parameter(
        'auto', 'Whether the images are raw (k and d of camera_info apply) or rectified (p '
        "applies); auto: rectified if 'rect' or 'rectified' is a part of the topic's name, or "
        'with subscribe_rgbd.',
        choices=('auto', 'raw', 'rectified'))
    register_depth: bool = parameter(
        False, 'Whether the node registers the depth images to the colour camera, using '
        'depth/camera_info; false: the driver does it.')
    depth_in_colour: tuple[float, ...] = parameter(
        (), 'Pose of the optical frame of the depth camera in that of the colour camera: x y z '
        'qx qy qz qw; empty: from TF.')
    process_every_frame: bool = parameter(
        False, 'Whether to register every frame, in order; false: only the newest one, while '
        'frames come faster than they can be registered.')
    shed_load: bool = parameter(
        True, 'Whether less is computed while frames come faster than they can be registered: '
        'fewer keypoints, then fewer points of the depth image, then every second frame. '
        'Without effect on process_every_frame.')
    max_update_rate: float = parameter(
        0.0, 'Maximum rate of registered frames; the others are dropped evenly. 0: no limit.',
        unit='Hz', minimum=0.0, maximum=1000.0)
