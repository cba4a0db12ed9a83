# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
RGB-D visual odometry by Adaptive Iterative Closest Keypoint (Ekekrantz et al., ECMR 2013).

The names below are the public ones. Each is imported from its folder where it is first used, so
that ``import aick_ros`` itself loads neither NumPy nor OpenCV.
"""

from importlib import import_module

# By its name true for type checkers. From typing it would take more than half of the time until
# the first line of a program of ours runs, in which it cannot handle a signal.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from aick_ros.errors import InputError
    from aick_ros.features.detector import Detector, Features
    from aick_ros.frames.imu import ImuSamples
    from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
    from aick_ros.frames.prepared import PreparedFrame
    from aick_ros.frames.rgbd import RgbdFrame
    from aick_ros.geometry.camera import Camera
    from aick_ros.geometry.pose import Increment, PoseWithCovariance
    from aick_ros.geometry.trajectory import Trajectory
    from aick_ros.odometry import Odometry, OdometryUpdate
    from aick_ros.registration.aick.aick import Aick
    from aick_ros.registration.expected_pose import ExpectedPose
    from aick_ros.registration.preparation import Preparation
    from aick_ros.registration.registrar import Registrar
    from aick_ros.registration.result import Registration
    from aick_ros.registration.status import Status
    from aick_ros.settings import Settings
    from aick_ros.settings.parameter import with_values
    from aick_ros.settings.presets import preset
    from aick_ros.sources import RgbdSource, SourceOptions, open_source

__version__ = '0.1.0'

_MODULES = {
    'Aick': 'registration.aick.aick',
    'Camera': 'geometry.camera',
    'Detector': 'features.detector',
    'ExpectedPose': 'registration.expected_pose',
    'Features': 'features.detector',
    'ImuSamples': 'frames.imu',
    'Increment': 'geometry.pose',
    'InputError': 'errors',
    'KeypointExtractor': 'frames.keypoints',
    'KeypointFrame': 'frames.keypoints',
    'Odometry': 'odometry',
    'OdometryUpdate': 'odometry',
    'PoseWithCovariance': 'geometry.pose',
    'Preparation': 'registration.preparation',
    'PreparedFrame': 'frames.prepared',
    'Registrar': 'registration.registrar',
    'Registration': 'registration.result',
    'RgbdFrame': 'frames.rgbd',
    'RgbdSource': 'sources',
    'Settings': 'settings',
    'SourceOptions': 'sources',
    'Status': 'registration.status',
    'Trajectory': 'geometry.trajectory',
    'open_source': 'sources',
    'preset': 'settings.presets',
    'with_values': 'settings.parameter',
}

__all__ = [
    '__version__', 'Aick', 'Camera', 'Detector', 'ExpectedPose', 'Features', 'ImuSamples',
    'Increment', 'InputError', 'KeypointExtractor', 'KeypointFrame', 'Odometry', 'OdometryUpdate',
    'PoseWithCovariance', 'Preparation', 'PreparedFrame', 'Registrar', 'Registration', 'RgbdFrame',
    'RgbdSource', 'Settings', 'SourceOptions', 'Status', 'Trajectory', 'open_source', 'preset',
    'with_values']

if not TYPE_CHECKING:  # type checkers would take it for a promise that any name exists
    def __getattr__(name: str) -> object:
        """Import a public name where it is first used (PEP 562)."""
        if name not in _MODULES:
            raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
        value = getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
