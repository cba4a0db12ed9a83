# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The compared methods by name: class, settings, requirements.

To add a method, add an entry here and, for a new class, a file in this folder.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any

import cv2

from aick_ros.errors import InputError, installation
from aick_ros.evaluation.baselines import Baseline

_HERE = __package__


@dataclass(frozen=True)
class Need:
    """
    Something that a method requires beyond the plain installation.

    :param is_met: returns whether it is installed.
    :param install: command that installs it.
    """

    is_met: Callable[[], bool]
    install: str


@dataclass(frozen=True)
class Method:
    """
    A method with its settings.

    :param title: one line, for tables and legends.
    :param settings: settings in words.
    :param factory: ``module:class``, called with the options.
    :param needs: requirements.
    """

    name: str
    title: str
    settings: str
    factory: str
    options: Mapping[str, Any] = field(default_factory=dict)
    needs: tuple[Need, ...] = ()

    @property
    def identity(self) -> str:
        """Everything that determines the results, as text."""
        return f'{self.factory} {json.dumps(self.options, sort_keys=True)}'

    @property
    def missing(self) -> str:
        """Command that installs what is missing; '' where nothing is."""
        return ' && '.join(need.install for need in self.needs if not need.is_met())


def make(factory: str, options: Mapping[str, Any]) -> Baseline:
    """Return the method of a factory (``module:class``), ready to run."""
    module, _, name = factory.partition(':')
    method: Baseline = getattr(import_module(module), name)(**options)
    return method


def methods_of(names: str) -> list[Method]:
    """
    Return the methods of a list of names.

    :param names: separated by commas; ``all`` for all.
    :raises InputError: for an unknown name; the message lists the known ones.
    """
    wanted = list(METHODS) if names == 'all' else [name.strip() for name in names.split(',')]
    for name in wanted:
        if name not in METHODS:
            raise InputError(f'no method is called {name!r}: the methods are all, '
                             f'{", ".join(METHODS)}')
    return [METHODS[name] for name in dict.fromkeys(wanted)]


def aick(name: str, title: str, settings: str, preset: str = '', **changes: Any) -> Method:
    """Return AICK with a preset's settings; ``__`` in the names of changes stands for a dot."""
    dotted = {key.replace('__', '.'): value for key, value in changes.items()}
    return Method(name, title, settings, f'{_HERE}.aick:AickMethod',
                  {'preset_name': preset, 'changes': dotted})


def _is_importable(module: str) -> bool:
    return importlib.util.find_spec(module) is not None


def _extra(module: str) -> Need:
    return Need(partial(_is_importable, module), installation('baselines'))


def _pcl(name: str, title: str, settings: str, max_depth: float, *arguments: str) -> Method:
    return Method(name, title, settings, f'{_HERE}.pcl:Pcl',
                  {'arguments': [name.partition('-')[0], *arguments], 'max_depth': max_depth},
                  (_PCL,))


def _has_pcl() -> bool:
    return import_module(f'{_HERE}.pcl').find_program() is not None


_PCL = Need(_has_pcl, 'apt install libpcl-dev cmake g++ && make pcl')
_OPENCV_5 = Need(lambda: hasattr(cv2, 'Odometry'), "pip install 'opencv-python-headless>=5'")

METHODS: Mapping[str, Method] = {method.name: method for method in (
    aick('aick', 'AICK, defaults', 'the defaults of this package'),
    aick('aick-orb', 'AICK ORB',
         'paper: all ORB keypoints, alpha 0.8, 25 iterations', 'paper-full'),
    aick('aick-orb-350', 'AICK ORB 350',
         'paper: at most 350 ORB keypoints, alpha 0.6, 10 iterations', 'paper-fast'),
    aick('aick-orb-fast', 'AICK ORB, vocabulary',
         'the same with a vocabulary of 1,000 words, R_w 0.26', 'paper-fast-words'),
    aick('aick-surf', 'AICK SURF',
         'paper: all SURF keypoints, alpha 0.8, 25 iterations', 'paper-full-surf'),
    aick('aick-surf-200', 'AICK SURF 200',
         'paper: at most 200 SURF keypoints, alpha 0.3, 5 iterations', 'paper-fast-surf'),
    aick('aick-surf-fast', 'AICK SURF, vocabulary',
         'the same with a vocabulary of 1,000 words, R_w 0.26', 'paper-fast-surf-words'),
    Method('ransac3', '3-point RANSAC',
           'paper: 400 models, inliers within 0.02 m, pairs within 0.2; all SURF keypoints',
           f'{_HERE}.ransac3:ThreePointRansac', {'preset_name': 'paper-full-surf'},
           (_extra('scipy'),)),
    Method('ransac3-orb', '3-point RANSAC, ORB', 'ransac3 with all ORB keypoints',
           f'{_HERE}.ransac3:ThreePointRansac', {'preset_name': 'paper-full'},
           (_extra('scipy'),)),
    _pcl('gicp', 'GICP (PCL)', 'paper: 25 iterations, pairs within 0.004 m; all points', 10.0,
         '0', '0.004', '25', '0'),
    _pcl('ndt', '3D-NDT (PCL)',
         'paper: voxels of 0.02 m, resolution 0.1, step size 0.09, 25 iterations', 10.0,
         '0.02', '0.1', '0.09', '25', '0'),
    _pcl('gicp-tuned', 'GICP (PCL), tuned',
         'voxels of 0.02 m, pairs within 0.05 m, at most 50 iterations, depth to 4 m', 4.0,
         '0.02', '0.05', '50', '1e-5'),
    _pcl('ndt-tuned', '3D-NDT (PCL), tuned',
         'voxels of 0.03 m, resolution 0.2, step size 0.05, at most 35 iterations, depth to 4 m',
         4.0, '0.03', '0.2', '0.05', '35', '1e-8'),
    Method('pnp', 'PnP RANSAC',
           'all ORB keypoints, cross-checked, at most 500 models, inliers within 3 px, refined',
           f'{_HERE}.pnp:Pnp', {'reprojection': 3.0}),
    Method('small-gicp', 'small_gicp',
           'GICP, voxels of 0.02 m, 20 neighbours, pairs within 0.1 m, depth to 4 m',
           f'{_HERE}.small_gicp:SmallGicp',
           {'voxel': 0.02, 'neighbours': 20, 'max_distance': 0.1, 'max_depth': 4.0,
            'iterations': 50, 'epsilon': 1e-4}, (_extra('small_gicp'),)),
    Method('open3d-hybrid', 'Open3D hybrid',
           'colour and depth, 20, 10 and 5 iterations, depth to 4 m, undistorted',
           f'{_HERE}.open3d_odometry:Open3dHybrid', needs=(_extra('open3d'),)),
    Method('open3d-plane', 'Open3D plane',
           'point to plane, 20, 10 and 5 iterations, depth to 4 m, undistorted',
           f'{_HERE}.open3d_odometry:Open3dPlane', needs=(_extra('open3d'),)),
    Method('opencv-depth', 'OpenCV depth',
           'cv2.Odometry on depth, its own settings (depth to 4 m), undistorted',
           f'{_HERE}.opencv_odometry:OpencvOdometry', {'colour': False}, (_OPENCV_5,)),
    Method('opencv-rgbd', 'OpenCV RGB-D',
           'cv2.Odometry on colour and depth, its own settings (depth to 4 m), undistorted',
           f'{_HERE}.opencv_odometry:OpencvOdometry', {'colour': True}, (_OPENCV_5,)),
)}
"""The methods by name, in the order in which tables have them."""
