# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Parameters of rtabmap_odom's ``rgbd_odometry``, and what each of them means here.

Those that have the same name and meaning here are not listed. ``READ_AS`` has those that set one
of ours, ``WITHOUT_EFFECT`` those that do not, each with the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from aick_ros.settings.parameter import Parameter, Value


@dataclass(frozen=True)
class ReadAs:
    """
    A parameter of ``rgbd_odometry`` that sets one of this node.

    :param theirs: declaration of their parameter.
    :param ours: name of the parameter of this node.
    :param convert: returns the value of ours for one of theirs.
    """

    theirs: Parameter
    ours: str
    convert: Callable[[Value], Value] = lambda value: value


@dataclass(frozen=True)
class WithoutEffect:
    """
    A parameter of ``rgbd_odometry`` that changes nothing here.

    :param reason: a sentence that says why, and what to do where something can be done.
    :param ours: name of the nearest parameter of this node, '' where there is none.
    :param off: whether false, 0 and '' switch off there what is absent here.
    """

    reason: str
    ours: str = ''
    off: bool = True


@dataclass
class Translation:
    """
    What parameters of ``rgbd_odometry`` mean for this node.

    :param values: parameters of this node by name.
    :param notes: sentences about those that have an effect.
    :param warnings: sentences about those that have none.
    """

    values: dict[str, object] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


# by the numbers of their parameter qos
_RELIABILITY: dict[Value, Value] = {0: 'auto', 1: 'reliable', 2: 'best_effort'}

READ_AS = {row.theirs.name: row for row in (
    ReadAs(Parameter('rgb_transport', str, 'raw', 'Transport of the colour images.'),
           'image_transport'),
    ReadAs(Parameter('queue_size', int, 5, 'Older name of sync_queue_size.'), 'sync_queue_size'),
    ReadAs(Parameter('qos', int, 0, 'QoS of the images: 0 default of the system, 1 reliable, '
                     '2 best effort.', minimum=0, maximum=2),
           'qos_reliability', _RELIABILITY.__getitem__),
    ReadAs(Parameter('publish_null_when_lost', bool, True,
                     'Whether to publish a null pose while tracking is lost.'),
           'lost_policy', lambda value: 'null' if value else 'silent'),
    ReadAs(Parameter('always_process_most_recent_frame', bool, True,
                     'Whether to register only the newest frame.'),
           'process_every_frame', lambda value: not value),
    ReadAs(Parameter('expected_update_rate', float, 0.0,
                     'Rate above which frames are dropped.', unit='Hz'),
           'max_update_rate'),
    ReadAs(Parameter('Rtabmap/ImagesAlreadyRectified', bool, True,
                     'Whether the images are rectified.'),
           'image_rectification', lambda value: 'rectified' if value else 'raw'),
    ReadAs(Parameter('Vis/RoiRatios', tuple, (0.0, 0.0, 0.0, 0.0),
                     'Shares of the image without keypoints: left right top bottom.'),
           'sensor.roi_ratios'),
    ReadAs(Parameter('Reg/Force3DoF', bool, False, 'Whether x, y and yaw alone are estimated.'),
           'odometry.planar'))}

_NO_IMU = ('an IMU is used from its first sample on, with the transform at each image and the '
           'QoS its publisher offers')
_NO_TRUTH = 'the odometry does not start at a ground truth: set initial_pose'
_NO_LIMIT_OF_GUESS = 'every frame is registered, however little the guess has moved'
_NO_DATA = 'odom_sensor_data is not published'
_OF_SLAM = 'it is a parameter of the SLAM node'

WITHOUT_EFFECT = {
    'qos_camera_info': WithoutEffect('camera_info is received with the QoS its publishers offer',
                                     off=False),
    'min_update_rate': WithoutEffect('after a pause of the camera the odometry continues from '
                                     'the last tracked frame'),
    'keep_color': WithoutEffect('odom_rgbd_image is always in colour'),
    'subscribe_depth': WithoutEffect(_OF_SLAM, off=False),
    'subscribe_rgb': WithoutEffect(_OF_SLAM, off=False),
    'subscribe_odom': WithoutEffect(_OF_SLAM, off=False),
    'subscribe_odom_info': WithoutEffect(_OF_SLAM, off=False),
    'always_check_imu_tf': WithoutEffect(_NO_IMU),
    'qos_imu': WithoutEffect(_NO_IMU),
    'imu_queue_size': WithoutEffect(_NO_IMU),
    'guess_min_translation': WithoutEffect(_NO_LIMIT_OF_GUESS, 'max_update_rate'),
    'guess_min_rotation': WithoutEffect(_NO_LIMIT_OF_GUESS, 'max_update_rate'),
    'guess_min_time': WithoutEffect(_NO_LIMIT_OF_GUESS, 'max_update_rate'),
    'guess_linear_variance': WithoutEffect('a motion by the guess is published with 9999'),
    'guess_angular_variance': WithoutEffect('a motion by the guess is published with 9999'),
    'ground_truth_frame_id': WithoutEffect(_NO_TRUTH, 'initial_pose'),
    'ground_truth_base_frame_id': WithoutEffect(_NO_TRUTH, 'initial_pose'),
    'config_path': WithoutEffect('the INI file of RTAB-Map is not read: give a ROS parameter '
                                 'file'),
    'log_to_rosout_level': WithoutEffect('set the level by --ros-args --log-level', off=False),
    'sensor_data_compression_format': WithoutEffect(_NO_DATA, off=False),
    'sensor_data_parallel_compression': WithoutEffect(_NO_DATA, off=False),
    'publish_compressed_sensor_data': WithoutEffect(_NO_DATA),
    'Odom/ResetCountdown': WithoutEffect('a lost odometry needs no reset: it continues as soon '
                                         'as the camera sees enough again'),
    'Odom/Strategy': WithoutEffect('frames are registered to keyframes or to a local map',
                                   'odometry.reference', off=False),
    'Odom/KeyFrameThr': WithoutEffect('keyframes change by overlap', 'odometry.min_overlap'),
    'Odom/GuessMotion': WithoutEffect('the motion is always predicted', off=False),
    'Vis/FeatureType': WithoutEffect('the detectors are others', 'features.detector', off=False),
    'Vis/MaxFeatures': WithoutEffect('the number of keypoints is limited',
                                     'features.max_keypoints', off=False),
    'Vis/MinInliers': WithoutEffect('the number of matches is limited',
                                    'odometry.min_matches', off=False),
    'Vis/MinDepth': WithoutEffect('the depth is limited', 'sensor.min_depth'),
    'Vis/MaxDepth': WithoutEffect('the depth is limited', 'sensor.max_depth'),
}
_OF_RTABMAP = WithoutEffect('it is a parameter of the algorithm of RTAB-Map, which is not that '
                            'of this node', off=False)


def is_theirs(name: str) -> bool:
    """Return whether a parameter is one of ``rgbd_odometry`` and not of this node."""
    return name in READ_AS or name in WITHOUT_EFFECT or '/' in name


def translate(given: Mapping[str, object]) -> Translation:
    """
    Return what the parameters of ``rgbd_odometry`` among the given ones mean here.

    A parameter of this node takes precedence over one that means the same.

    :raises InputError: where a value is not one that their parameter can have.
    """
    translation = Translation()
    for name, value in given.items():
        if name in READ_AS:
            _read(READ_AS[name], value, given, translation)
        elif is_theirs(name):
            row = WITHOUT_EFFECT.get(name, _OF_RTABMAP)
            if not (row.off and _is_off(value)):
                nearest = f' (see {row.ours})' if row.ours else ''
                translation.warnings.append(
                    f'parameter {name!r} of rgbd_odometry changes nothing here: '
                    f'{row.reason}{nearest}')
    return translation


def _read(row: ReadAs, value: object, given: Mapping[str, object],
          translation: Translation) -> None:
    converted = row.convert(row.theirs.convert(value))
    if row.ours in given:
        translation.notes.append(f'parameter {row.theirs.name!r} is not read, as {row.ours} is '
                                 'given')
        return
    translation.values[row.ours] = converted
    translation.notes.append(f'parameter {row.theirs.name!r} is read as {row.ours} = '
                             f'{converted!r}')


def _is_off(value: object) -> bool:
    return not value or str(value).lower() in ('false', '0', '0.0')
