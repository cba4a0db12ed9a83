# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the parameters of rgbd_odometry mean here: each is read, or explained."""

import re
from pathlib import Path

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import parameters, values, with_values
from aick_ros.settings.rtabmap import READ_AS, WITHOUT_EFFECT, is_theirs, translate

OURS = {p.name for group in (NodeSettings, Settings) for p in parameters(group)}
PAGE = (Path(__file__).parents[2] / 'docs' / 'node.md').read_text()


@pytest.mark.parametrize('name, value, ours, expected', [
    ('rgb_transport', 'compressed', 'image_transport', 'compressed'),
    ('queue_size', 7, 'sync_queue_size', 7),
    ('queue_size', '7', 'sync_queue_size', 7),
    ('qos', 0, 'qos_reliability', 'auto'),
    ('qos', 1, 'qos_reliability', 'reliable'),
    ('qos', 2, 'qos_reliability', 'best_effort'),
    ('publish_null_when_lost', True, 'lost_policy', 'null'),
    ('publish_null_when_lost', False, 'lost_policy', 'silent'),
    ('always_process_most_recent_frame', True, 'process_every_frame', False),
    ('always_process_most_recent_frame', 'false', 'process_every_frame', True),
    ('expected_update_rate', 15, 'max_update_rate', 15.0),
    ('Rtabmap/ImagesAlreadyRectified', 'False', 'image_rectification', 'raw'),
    ('Rtabmap/ImagesAlreadyRectified', 'true', 'image_rectification', 'rectified'),
    ('Vis/RoiRatios', '0.1 0 0.0 0.25', 'sensor.roi_ratios', (0.1, 0.0, 0.0, 0.25)),
    ('Reg/Force3DoF', 'true', 'odometry.planar', True)])
def test_what_means_the_same_is_read(name, value, ours, expected):
    translation = translate({name: value})
    assert translation.values == {ours: expected}
    group = NodeSettings() if ours in values(NodeSettings) else Settings()
    assert values(with_values(group, translation.values))[ours] == expected
    assert translation.warnings == []
    assert translation.notes == [f'parameter {name!r} is read as {ours} = {expected!r}']


def test_our_own_parameter_takes_precedence():
    translation = translate({'publish_null_when_lost': True, 'lost_policy': 'hold'})
    assert translation.values == {}
    assert translation.notes == ["parameter 'publish_null_when_lost' is not read, as lost_policy "
                                 'is given']


@pytest.mark.parametrize('given, sentence', [
    ({'qos': 3}, 'qos = 3 is outside 0 to 2'),
    ({'publish_null_when_lost': 'maybe'}, "'maybe' is not true or false")])
def test_a_value_that_theirs_cannot_have_is_rejected(given, sentence):
    with pytest.raises(InputError, match=sentence):
        translate(given)


@pytest.mark.parametrize('name, reason', [
    ('always_check_imu_tf', 'with the transform at each image'),
    ('Odom/ResetCountdown', 'a lost odometry needs no reset'),
    ('guess_min_rotation', 'however little the guess has moved (see max_update_rate)'),
    ('Vis/MaxFeatures', '(see features.max_keypoints)'),
    ('keep_color', 'odom_rgbd_image is always in colour'),
    ('subscribe_odom', 'a parameter of the SLAM node'),
    ('qos_camera_info', 'with the QoS its publishers offer'),
    ('Vis/CorNNDR', 'the algorithm of RTAB-Map, which is not that of this node')])
def test_what_has_no_counterpart_is_explained(name, reason):
    translation = translate({name: '1'})
    assert translation.values == {}
    [warning] = translation.warnings
    assert warning.startswith(f'parameter {name!r} of rgbd_odometry changes nothing here: ')
    assert reason in warning


@pytest.mark.parametrize('given', [
    {'always_check_imu_tf': False}, {'keep_color': False}, {'config_path': ''},
    {'ground_truth_frame_id': ''}, {'guess_min_time': 0.0},
    {'Odom/ResetCountdown': '0'}])
def test_what_is_switched_off_there_is_no_difference(given):
    assert translate(given).warnings == []


@pytest.mark.parametrize('name, value', [
    ('qos_camera_info', 0), ('subscribe_depth', False), ('Odom/Strategy', 0),
    ('Odom/GuessMotion', 'false'), ('Vis/FeatureType', '0'), ('Vis/MaxFeatures', '0'),
    ('sensor_data_parallel_compression', False), ('Mem/UseOdomFeatures', 'false')])
def test_what_is_not_switched_off_by_its_value_is_a_difference(name, value):
    """Zero is a choice like others there, as QoS 0 or the first strategy."""
    found = translate({name: value})
    warning, = found.warnings
    assert f"'{name}' of rgbd_odometry changes nothing here" in warning
    assert not found.values


def test_each_counterpart_exists_and_no_name_is_ours():
    rows = [*READ_AS.values(), *WITHOUT_EFFECT.values()]
    assert {row.ours for row in rows} - {''} <= OURS
    assert not ({*READ_AS, *WITHOUT_EFFECT} & OURS)
    assert set(READ_AS).isdisjoint(WITHOUT_EFFECT)


def test_ours_are_left_alone():
    given = {**values(NodeSettings), **values(Settings)}
    assert not any(map(is_theirs, given))
    assert translate(given).values == {}


@pytest.mark.parametrize('name', READ_AS)
def test_the_page_names_what_is_read(name):
    assert re.search(rf'`{name}`.*`{READ_AS[name].ours}`', PAGE)


@pytest.mark.parametrize('name, ours', [
    ('guess_min_translation', 'max_update_rate'), ('guess_min_rotation', 'max_update_rate'),
    ('guess_min_time', 'max_update_rate'), ('ground_truth_frame_id', 'initial_pose'),
    ('ground_truth_base_frame_id', 'initial_pose'), ('Odom/Strategy', 'odometry.reference'),
    ('Odom/KeyFrameThr', 'odometry.min_overlap'), ('Vis/FeatureType', 'features.detector'),
    ('Vis/MaxFeatures', 'features.max_keypoints'), ('Vis/MinInliers', 'odometry.min_matches'),
    ('Vis/MinDepth', 'sensor.min_depth'), ('Vis/MaxDepth', 'sensor.max_depth')])
def test_the_nearest_of_ours_is_named(name, ours):
    [warning] = translate({name: 'x'}).warnings
    assert warning.endswith(f' (see {ours})')


REASONS = {
    'camera_info is received with the QoS its publishers offer': ['qos_camera_info'],
    'after a pause of the camera the odometry continues from the last tracked frame': [
        'min_update_rate'],
    'odom_rgbd_image is always in colour': ['keep_color'],
    'it is a parameter of the SLAM node': ['subscribe_depth', 'subscribe_rgb', 'subscribe_odom',
                                           'subscribe_odom_info'],
    'an IMU is used from its first sample on, with the transform at each image and the QoS its '
    'publisher offers': ['always_check_imu_tf', 'qos_imu', 'imu_queue_size'],
    'every frame is registered, however little the guess has moved': [
        'guess_min_translation', 'guess_min_rotation', 'guess_min_time'],
    'a motion by the guess is published with 9999': ['guess_linear_variance',
                                                     'guess_angular_variance'],
    'the odometry does not start at a ground truth: set initial_pose': [
        'ground_truth_frame_id', 'ground_truth_base_frame_id'],
    'the INI file of RTAB-Map is not read: give a ROS parameter file': ['config_path'],
    'set the level by --ros-args --log-level': ['log_to_rosout_level'],
    'odom_sensor_data is not published': [
        'sensor_data_compression_format', 'sensor_data_parallel_compression',
        'publish_compressed_sensor_data'],
    'a lost odometry needs no reset: it continues as soon as the camera sees enough again': [
        'Odom/ResetCountdown'],
    'frames are registered to keyframes or to a local map': ['Odom/Strategy'],
    'keyframes change by overlap': ['Odom/KeyFrameThr'],
    'the motion is always predicted': ['Odom/GuessMotion'],
    'the detectors are others': ['Vis/FeatureType'],
    'the number of keypoints is limited': ['Vis/MaxFeatures'],
    'the number of matches is limited': ['Vis/MinInliers'],
    'the depth is limited': ['Vis/MinDepth', 'Vis/MaxDepth'],
    'it is a parameter of the algorithm of RTAB-Map, which is not that of this node': [
        'Vis/CorNNDR', 'Any/Other']}


@pytest.mark.parametrize('reason', REASONS)
def test_a_warning_gives_its_reason(reason):
    for name in REASONS[reason]:
        [warning] = translate({name: 'x'}).warnings
        nearest = WITHOUT_EFFECT[name].ours if name in WITHOUT_EFFECT else ''
        assert warning == (f'parameter {name!r} of rgbd_odometry changes nothing here: {reason}'
                           + (f' (see {nearest})' if nearest else ''))


def test_every_parameter_without_effect_has_such_a_reason():
    assert set(WITHOUT_EFFECT) <= {name for names in REASONS.values() for name in names}


@pytest.mark.parametrize('name, value, meaning', [
    ('queue_size', 'x', 'Older name of sync_queue_size.'),
    ('qos', 3, 'QoS of the images: 0 default of the system, 1 reliable, 2 best effort.'),
    ('rgb_transport', 3, 'Transport of the colour images.'),
    ('publish_null_when_lost', 3, 'Whether to publish a null pose while tracking is lost.'),
    ('always_process_most_recent_frame', 3, 'Whether to register only the newest frame.'),
    ('expected_update_rate', 'x', 'Rate above which frames are dropped.'),
    ('Rtabmap/ImagesAlreadyRectified', 3, 'Whether the images are rectified.'),
    ('Reg/Force3DoF', 3, 'Whether x, y and yaw alone are estimated.')])
def test_an_error_says_what_their_parameter_means(name, value, meaning):
    with pytest.raises(InputError, match=f' Meaning: {re.escape(meaning)}$'):
        translate({name: value})
