# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Imports run one way, never in a circle; folders are few, functions short."""

import ast
import functools
import graphlib
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / 'aick_ros'
KERNELS = PACKAGE.parent / 'src' / 'kernels'
FOLDERS = sorted(path.parent for path in PACKAGE.rglob('__init__.py'))

IMPORTS = {
    'errors': '',
    'kernels': '_kernels errors',
    'borders': 'errors',
    'geometry': 'kernels errors borders',
    'settings': 'errors',
    'features': 'kernels errors borders geometry settings',
    'frames': 'kernels errors borders geometry settings features',
    'messages': 'errors borders geometry settings features frames',
    'registration': 'kernels errors borders geometry settings features frames',
    'odometry': 'kernels errors borders geometry settings features frames registration',
    'sources': 'errors borders geometry settings features frames messages',
    'ros': 'errors borders geometry settings features frames messages registration odometry',
    'evaluation': 'kernels errors borders geometry settings features frames messages registration '
                  'odometry sources',
    'reports': 'errors borders geometry settings frames registration odometry sources evaluation',
    'cli': 'errors borders geometry settings features frames messages registration odometry '
           'sources ros evaluation reports',
}
LONGEST_FUNCTION = 40  # lines, docstring included
LONGEST_LINE = 99
CORE = ('errors kernels borders geometry settings features frames messages registration '
        'odometry').split()


@functools.cache
def imported(path):
    """Return the full names that a file imports, anywhere in it."""
    nodes = [*ast.walk(ast.parse(path.read_text()))]
    return [*(alias.name for node in nodes if isinstance(node, ast.Import)
              for alias in node.names),
            *(f'{node.module}.{alias.name}' for node in nodes if isinstance(node, ast.ImportFrom)
              for alias in node.names)]


def room_of(path):
    """Return the folder at the top of the package, or the file there, that a file belongs to."""
    return path.relative_to(PACKAGE).parts[0].removesuffix('.py')


def files_of(room):
    return [path for path in PACKAGE.rglob('*.py') if room_of(path) == room]


def test_every_folder_has_its_place():
    rooms = {room_of(path) for path in PACKAGE.rglob('*.py')} - {'__init__', '__main__'}
    assert rooms == set(IMPORTS)


@pytest.mark.parametrize('room', IMPORTS)
def test_a_folder_imports_only_from_those_below(room):
    allowed = {*IMPORTS[room].split(), room, '__version__'}
    for path in files_of(room):
        names = [name.split('.') for name in imported(path)]
        rooms = {name[1] for name in names if name[0] == 'aick_ros' and len(name) > 1}
        assert rooms <= allowed, f'{path}: {rooms - allowed}'


@pytest.mark.parametrize('room', CORE)
def test_the_core_imports_numpy_and_opencv_only(room):
    for path in files_of(room):
        top = {name.partition('.')[0] for name in imported(path)} - sys.stdlib_module_names
        allowed = {'yaml'} if path.name == 'yaml_text.py' else set()
        assert top <= {'aick_ros', 'numpy', 'cv2', *allowed}, path


def test_only_the_ros_folder_imports_rclpy():
    for room in set(IMPORTS) - {'ros'}:
        for path in files_of(room):
            assert 'rclpy' not in {name.partition('.')[0] for name in imported(path)}, path


@pytest.mark.parametrize('folder', FOLDERS, ids=lambda path: path.name)
def test_no_imports_run_in_a_circle(folder):
    """Between the files and subfolders of a folder; all files of a subfolder count as one."""
    parts = {path.stem: [path] if path.is_file() else [*path.rglob('*.py')]
             for path in folder.iterdir() if path in FOLDERS
             or path.suffix == '.py' and path.name != '__init__.py'}
    prefix = '.'.join(folder.relative_to(PACKAGE.parent).parts) + '.'
    graph = {part: {name.removeprefix(prefix).partition('.')[0] for path in paths
                    for name in imported(path) if name.startswith(prefix)} & {*parts} - {part}
             for part, paths in parts.items()}
    assert len(list(graphlib.TopologicalSorter(graph).static_order())) == len(parts)


def test_functions_fit_on_a_screen():
    long = {f'{path.name}: {node.name}': lines for path in PACKAGE.rglob('*.py')
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.FunctionDef)
            and (lines := node.end_lineno - node.lineno + 1) > LONGEST_FUNCTION}
    assert not long


def test_the_package_has_few_folders():
    assert len([path for path in FOLDERS if path.parent == PACKAGE]) <= 13


def test_lines_of_the_kernels_are_no_longer_than_those_of_python():
    long = [f'{path.name}: {number}' for path in KERNELS.glob('*.[ch]')
            for number, line in enumerate(path.read_text().splitlines(), 1)
            if len(line) > LONGEST_LINE]
    assert not long
