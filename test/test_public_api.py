# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The public names: what they are, that importing the package is cheap, and that it is typed."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import aick_ros

FILE = Path(aick_ros.__file__)
NAMES = [name for name in aick_ros.__all__ if name != '__version__']


def run(code):
    return subprocess.run([sys.executable, '-c', code], check=True, text=True,
                          stdout=subprocess.PIPE).stdout


def names_for_type_checkers():
    """Return the imports under TYPE_CHECKING: name -> module."""
    block = next(node for node in ast.parse(FILE.read_text()).body if isinstance(node, ast.If))
    return {alias.name: node.module for node in block.body for alias in node.names}


def test_the_names_a_user_needs_are_public():
    assert {'Aick', 'Camera', 'InputError', 'KeypointExtractor', 'Odometry', 'OdometryUpdate',
            'PoseWithCovariance', 'Registrar', 'Registration', 'RgbdFrame', 'Settings', 'Status',
            'open_source'} <= set(NAMES)


@pytest.mark.parametrize('name', NAMES)
def test_each_name_is_that_of_its_folder(name):
    module = importlib.import_module(names_for_type_checkers()[name])
    assert getattr(aick_ros, name) is getattr(module, name)


def test_type_checkers_see_the_same_names():
    assert set(names_for_type_checkers()) == set(NAMES)


def test_importing_the_package_loads_nothing_large():
    loaded = set(run('import aick_ros, sys; dir(aick_ros); print(*sys.modules)').split())
    assert not loaded & {'cv2', 'numpy', 'rclpy', 'rosbags', 'yaml', 'typer'}
    assert {name for name in loaded if name.startswith('aick_ros')} == {'aick_ros'}


def test_the_odometry_loads_no_reader():
    loaded = set(run('import sys; from aick_ros import Odometry; print(*sys.modules)').split())
    assert not loaded & {'rclpy', 'rosbags', 'yaml', 'typer'}


def test_dir_lists_the_names_before_they_are_imported():
    assert run('import aick_ros; print(*dir(aick_ros))').split() == sorted(aick_ros.__all__)


def test_all_names_can_be_imported_at_once():
    assert run('from aick_ros import *; print(Odometry.__name__)').strip() == 'Odometry'


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match='no attribute .Odometer.'):
        aick_ros.Odometer


def test_the_package_says_that_it_is_typed():
    assert (FILE.parent / 'py.typed').is_file()
    assert "'py.typed'" in (FILE.parents[1] / 'setup.py').read_text()
