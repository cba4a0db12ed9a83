# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odd arguments to the public names: an InputError or the right result, and no warning."""

import dataclasses
import math
import warnings

import numpy as np
import pytest

import aick_ros
from aick_ros import (
    Aick, Camera, ExpectedPose, Features, ImuSamples, Increment, InputError, KeypointExtractor,
    KeypointFrame, Odometry, PoseWithCovariance, Preparation, Registrar, RgbdFrame, Settings,
    SourceOptions, Trajectory, open_source, preset, with_values)
from aick_ros.odometry.other_odometry import no_odometry

CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
RNG = np.random.default_rng(0)
FRAME = RgbdFrame(10 ** 9, RNG.integers(0, 256, (48, 64, 3)).astype(np.uint8),
                  np.full((48, 64), 1.5, np.float32), CAMERA)
IMU = ImuSamples(np.arange(4), np.zeros((4, 3)), np.ones((4, 3)))
PATH = Trajectory(np.arange(3), np.tile(np.eye(4), (3, 1, 1)))
POSE = PoseWithCovariance.identity()
POINT = {'pixels': np.ones((2, 2), np.float32), 'descriptors': np.ones((2, 32), np.uint8),
         'responses': np.ones(2, np.float32), 'scales': np.ones(2, np.float32)}
KEYPOINTS = {'stamp': 1, 'positions': np.ones((2, 3), np.float32),
             'descriptors': np.ones((2, 32), np.uint8),
             'covariances': np.ones((2, 3, 3), np.float32), 'pixels': np.ones((2, 2), np.float32)}
PLANAR = with_values(Settings(), {'odometry.planar': True})


class _Returns:
    """A detector that returns any object."""

    def __init__(self, features):
        self._features = features

    def detect(self, grey):
        return self._features


def _registrar(use):
    def call(value):
        registrar = Registrar()
        return use(registrar, registrar.prepare(FRAME), value)
    return call


OF_ANY_KIND = {
    'Odometry': Odometry, 'change_settings': lambda value: Odometry().change_settings(value),
    'detector': lambda value: Odometry(detector=5 if value is None else value),
    'register_frame': lambda value: Odometry().register_frame(value),
    'prepare': lambda value: Odometry().prepare(value),
    'register': lambda value: Odometry().register(value),
    'predict': lambda value: Odometry().register_frame(FRAME, value),
    'features': lambda value: Odometry(detector=_Returns(value)).register_frame(FRAME),
    'imu': lambda value: dataclasses.replace(FRAME, imu=0 if value is None else value),
    'colour': lambda value: dataclasses.replace(FRAME, colour=value),
    'stamp': lambda value: dataclasses.replace(FRAME, stamp=value),
    'Registrar': Registrar,
    'times': lambda value: Registrar(times=5 if value is None else value),
    'Registrar.prepare': lambda value: Registrar().prepare(value),
    'source': _registrar(lambda registrar, frame, value: registrar.register(value, frame)),
    'target': _registrar(lambda registrar, frame, value: registrar.register(frame, value)),
    'expected': _registrar(lambda registrar, frame, value: registrar.register(
        frame, frame, 5 if value is None else value)),
    'elapsed': _registrar(lambda registrar, frame, value: registrar.register(
        frame, frame, ExpectedPose(np.eye(4), value))),
    'ExpectedPose': _registrar(lambda registrar, frame, value: registrar.register(
        frame, frame, ExpectedPose(np.eye(4), 0.1, 5 if value is None else value))),
    'T_target_source': _registrar(lambda registrar, frame, value: registrar.track(
        frame, frame, ExpectedPose(value))),
    'recognize': _registrar(lambda registrar, frame, value: registrar.recognize(frame, value)),
    'track': _registrar(lambda registrar, frame, value: registrar.track(
        frame, frame, value)),
    'register_depth': _registrar(lambda registrar, frame, value: registrar.register_depth(
        frame, frame, value, np.eye(6))),
    'Preparation': lambda value: Preparation(value, Registrar().preparer),
    'add_imu': lambda value: Odometry().prepare(FRAME).add_imu(0 if value is None else value),
    'Aick': Aick, 'Aick.register': lambda value: Aick().register(
        KeypointFrame(**KEYPOINTS), value),
    'KeypointExtractor': lambda value: KeypointExtractor(value, Settings().sensor),
    'extract': lambda value: KeypointExtractor(
        Settings().features, Settings().sensor).extract(value),
    **{f'Features.{name}': lambda value, name=name: Features(**{**POINT, name: value})
       for name in POINT},
    **{f'KeypointFrame.{name}': lambda value, name=name: KeypointFrame(
        **{**KEYPOINTS, name: value}) for name in KEYPOINTS if name != 'stamp'},
    **{f'ImuSamples.{name}': lambda value, name=name: dataclasses.replace(IMU, **{name: value})
       for name in ('stamps', 'turn_rates', 'accelerations', 'position')},
    'until': lambda value: IMU.until(value), 'in_camera': lambda value: IMU.in_camera(value),
    'Trajectory.stamps': lambda value: Trajectory(value, PATH.poses),
    'Trajectory.poses': lambda value: Trajectory(PATH.stamps, value),
    'at': lambda value: PATH.at(value), 'max_gap': lambda value: Trajectory(
        np.array([0, 10]), PATH.poses[:2]).at(5, value),
    'PoseWithCovariance': PoseWithCovariance,
    'covariance': lambda value: PoseWithCovariance(np.eye(4), value),
    'matmul': lambda value: POSE @ value, 'relative_to': lambda value: POSE.relative_to(value),
    'since': lambda value: POSE.since(value), 'in_body': lambda value: POSE.in_body(value),
    'Increment': lambda value: Increment(value, 1.0),
    'interval': lambda value: Increment(POSE, value),
    'normalize': lambda value: CAMERA.normalize(value),
    'project': lambda value: CAMERA.project(value),
    'back_project': lambda value: CAMERA.back_project(np.ones((3, 2)), value),
    'camera_info': lambda value: Camera.from_camera_info(
        4, 4, (4, 0, 2, 0, 4, 2, 0, 0, 1), (), value),
    'with_values': lambda value: with_values(Settings(), value),
    'name of a parameter': lambda value: with_values(Settings(), {str(value): 1}),
    'preset': preset, 'open_source': open_source,
    'options': lambda value: open_source('synthetic:1', value),
    'max_interval': lambda value: SourceOptions(max_interval=value),
    'register_depth of a source': lambda value: SourceOptions(register_depth=value),
    **{name: lambda value, name=name: SourceOptions(**{name: 5 if value is None else value})
       for name in ('camera', 'colour_topic', 'depth_topic', 'info_topic', 'depth_info_topic',
                    'ground_truth_topic', 'depth_in_colour')},
    'T_odom_camera': lambda value: Odometry(T_odom_camera=0 if value is None else value),
    'T_base_camera': lambda value: Odometry(PLANAR).register_frame(
        FRAME, no_odometry, 0 if value is None else value)}
"""A use of each argument that no object of another kind can be."""

OTHERS = {
    'None': None, 'object': object(), 'ragged': [[1], [2, 3]], 'mapping': {1: 2},
    'complex': 1 + 2j, 'complex array': np.zeros((5, 7), complex),
    'objects': np.array([None, 1.0]), 'times': np.zeros((2, 2), 'M8[ns]'), 'nan': math.nan}


@pytest.mark.parametrize('other', OTHERS)
@pytest.mark.parametrize('use', OF_ANY_KIND)
def test_what_is_of_another_kind_is_an_input_error(use, other):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with pytest.raises(InputError) as raised:
            OF_ANY_KIND[use](OTHERS[other])
    assert len(str(raised.value)) > 20


_MIRRORED, _SCALED, _FAR = np.diag([1.0, 1, -1, 1]), np.diag([2.0, 2, 2, 1]), np.eye(4)
_FAR[0, 3] = 1e300


@pytest.mark.parametrize('matrix', [
    _MIRRORED, _SCALED, _FAR, np.full((4, 4), np.nan), np.zeros((4, 4)), np.full((4, 4), np.inf)])
@pytest.mark.parametrize('use', [
    'PoseWithCovariance', 'matmul', 'relative_to', 'since', 'in_body', 'T_target_source',
    'ExpectedPose', 'T_odom_camera', 'T_base_camera'])
def test_what_is_not_rigid_is_no_pose(use, matrix):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with pytest.raises(InputError, match='is not a pose'):
            OF_ANY_KIND[use](matrix)


@pytest.mark.parametrize('matrix', [
    np.eye(4).tolist(), np.eye(4, dtype=np.float32), np.eye(4, dtype=int),
    np.asfortranarray(np.eye(4)), np.eye(8)[::2, ::2]])
def test_a_pose_of_any_type_of_numbers_is_that_pose(matrix):
    moved = np.eye(4)
    moved[0, 3] = 2.0
    pose = PoseWithCovariance(matrix) @ moved
    np.testing.assert_array_equal(pose.matrix, moved)
    assert PoseWithCovariance(matrix).matrix.dtype == np.float64


@pytest.mark.parametrize('interval', [0.0, -1.0, math.inf])
def test_a_motion_takes_some_time(interval):
    with pytest.raises(InputError, match='interval'):
        Increment(POSE, interval)


def test_stamps_of_a_trajectory_increase():
    with pytest.raises(InputError, match='do not increase: sort them'):
        Trajectory(np.array([2, 1, 3]), PATH.poses)


def test_descriptors_of_two_detectors_are_not_compared():
    other = {**KEYPOINTS, 'descriptors': np.ones((2, 128), np.float32)}
    with pytest.raises(InputError, match='32 uint8 and 128 float32'):
        Aick().register(KeypointFrame(**KEYPOINTS), KeypointFrame(**KEYPOINTS | other))


def test_a_file_descriptor_is_no_calibration_file():
    """True is 1 to open(): the standard output would be read, and closed."""
    with pytest.raises(InputError, match='camera'):
        SourceOptions(camera=True)


def test_every_public_class_is_tried():
    tried = {name.partition('.')[0] for name in OF_ANY_KIND} | {'Camera', 'RgbdFrame', 'Settings'}
    results = {'Detector', 'InputError', 'OdometryUpdate', 'PreparedFrame', 'Registration',
               'RgbdSource', 'SourceOptions', 'Status', '__version__'}
    assert set(aick_ros.__all__) - tried - results == set()
