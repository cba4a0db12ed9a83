# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The parameters that the node has beside those of the core."""

from __future__ import annotations

from dataclasses import dataclass

from aick_ros.settings.parameter import parameter


@dataclass(frozen=True)
class NodeSettings:
    """Settings of the ROS node around the core."""

    frame_id: str = parameter(
        'base_link', 'Frame whose motion is published (REP-105).')
    odom_frame_id: str = parameter('odom', 'Frame the pose is given in (REP-105).')
    publish_tf: bool = parameter(
        True, 'Whether to publish odom_frame_id -> frame_id on /tf.')
    camera_in_base: tuple = parameter(
        (), "Pose of the camera's optical frame in frame_id: x y z qx qy qz qw; empty: from TF.")
    initial_pose: tuple = parameter(
        (), 'Where frame_id is at the start: x y z [m] roll pitch yaw [rad]; empty: the origin.')
    guess_frame_id: str = parameter(
        '', "Frame of another odometry, the wheels' for example, whose transform to frame_id goes "
        'on where the camera is lost; TF is then published to it. Empty: none.')
    lost_policy: str = parameter(
        'hold', 'What is published while the camera is lost: the last pose without weight, a null '
        'pose, or nothing.', choices=('hold', 'null', 'silent'))
    twist_covariance: str = parameter(
        'velocity', 'Whether the covariance of the twist is that of the velocity, as the message '
        'defines it, or that of the increment since the last frame, as RTAB-Map reads it.',
        choices=('velocity', 'increment'))
    wait_for_transform: float = parameter(
        0.1, 'How long a frame waits for a transform that moves to be told up to its stamp.',
        unit='s', minimum=0.0, maximum=10.0)
    approx_sync: bool = parameter(
        True, 'Whether colour and depth may differ in stamp.')
    approx_sync_max_interval: float = parameter(
        0.02, 'Largest difference of stamps of one frame.', unit='s', minimum=0.0, maximum=1.0)
    topic_queue_size: int = parameter(
        10, 'Queue of each image subscription.', minimum=1, maximum=1000)
    sync_queue_size: int = parameter(
        5, 'Images of one topic that wait for their partner.', minimum=1, maximum=1000)
    qos_reliability: str = parameter(
        'auto', 'Reliability of the image subscriptions; auto: what the publishers offer.',
        choices=('auto', 'reliable', 'best_effort'))
    image_transport: str = parameter(
        'raw', 'Transport of the colour images: raw from rgb/image, compressed from '
        'rgb/image/compressed.', choices=('raw', 'compressed'))
    depth_transport: str = parameter(
        'raw', 'Transport of the depth images, likewise: PNG, with compressedDepth also RVL.',
        choices=('raw', 'compressed', 'compressedDepth'))
    image_rectification: str = parameter(
        'auto', 'Whether images are raw (k and d of camera_info hold) or rectified (p does); '
        "auto: rectified where 'rect' is a part of the topic's name.",
        choices=('auto', 'raw', 'rectified'))
    register_depth: bool = parameter(
        False, 'Whether depth is not registered to colour yet: the node does it, with '
        'depth/camera_info.')
    depth_in_colour: tuple = parameter(
        (), "Pose of the depth camera's optical frame in the colour camera's: x y z qx qy qz qw; "
        'empty: from TF.')
    process_every_frame: bool = parameter(
        False, 'Whether every frame is registered, in order, or the newest one only.')
    max_update_rate: float = parameter(
        0.0, 'Frames registered a second at most, the others are left out evenly; 0: all.',
        unit='Hz', minimum=0.0, maximum=1000.0)
