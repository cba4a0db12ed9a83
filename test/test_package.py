# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names, versions and requirements agree between the files that have them and with the code."""

import ast
import importlib
import importlib.metadata
import os
import re
import runpy
import shutil
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import setuptools
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import aick_ros

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / 'aick_ros').rglob('*.py'))
MODULES_OF_KEYS = {'numpy': 'python3-numpy', 'cv2': 'python3-opencv', 'yaml': 'python3-yaml'}
MODULES_OF_PACKAGES = {'cv2': 'opencv-python-headless', 'rerun': 'rerun-sdk', 'yaml': 'pyyaml'}


@pytest.fixture(scope='module')
def manifest():
    return ElementTree.parse(ROOT / 'package.xml').getroot()


@pytest.fixture
def setup_arguments(monkeypatch):
    """Return what setup.py gives to setuptools."""
    given = {}
    monkeypatch.setattr(setuptools, 'setup', lambda **arguments: given.update(arguments))
    monkeypatch.setattr(sys, 'argv', ['setup.py', 'bdist_wheel'])
    monkeypatch.chdir(ROOT)
    runpy.run_path('setup.py')
    return given


@pytest.fixture
def requirements(setup_arguments):
    extras = setup_arguments['extras_require'].values()
    return [Requirement(text) for text in
            [*setup_arguments['install_requires'], *(text for extra in extras for text in extra)]]


def pins_of(name):
    """Return version by package of a file in requirements/."""
    lines = (ROOT / 'requirements' / name).read_text().splitlines()
    found = [Requirement(line) for line in lines if line and not line.startswith('#')]
    return {canonicalize_name(pin.name): str(pin.specifier).removeprefix('==') for pin in found}


@pytest.fixture(scope='module')
def pins():
    return pins_of('constraints.txt')


def imports(path):
    """Return the full names that a file imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.update(f'{node.module}.{alias.name}' for alias in node.names)
    return found


def top_level(names):
    return {name.partition('.')[0] for name in names} - sys.stdlib_module_names - {'aick_ros'}


def test_one_version(manifest, setup_arguments):
    released = re.search(r'^(\d+\.\d+\.\d+) \(', (ROOT / 'CHANGELOG.rst').read_text(), re.M)[1]
    assert aick_ros.__version__ == manifest.findtext('version') == released
    assert setup_arguments['version'] == released


def test_one_licence(manifest, setup_arguments):
    assert manifest.findtext('license') == setup_arguments['license'] == 'Apache-2.0'
    assert 'Apache License' in (ROOT / manifest.find('license').get('file')).read_text()
    code = [*SOURCES, *(ROOT / 'scripts').iterdir(), ROOT / 'setup.py', ROOT / 'Makefile']
    for folder in ('launch', 'test', 'tools'):
        code += (ROOT / folder).rglob('*.py')
    assert [str(path) for path in code
            if 'SPDX-License-Identifier: Apache-2.0' not in path.read_text()[:200]] == []


def test_one_name_and_maintainer(manifest, setup_arguments):
    assert manifest.findtext('name') == setup_arguments['name'] == 'aick_ros'
    assert manifest.findtext('maintainer') == setup_arguments['maintainer']
    assert manifest.find('maintainer').get('email') == setup_arguments['maintainer_email']


def test_ros_tools_accept_the_manifest():
    catkin_package = pytest.importorskip('catkin_pkg.package')
    warnings = []
    package = catkin_package.parse_package(str(ROOT), warnings=warnings)
    package.validate(warnings=warnings)
    assert package.get_build_type() == 'ament_python'
    assert warnings == []


def test_manifest_names_what_the_code_imports(manifest):
    keys = {element.text for element in manifest.findall('exec_depend')}
    files = [*SOURCES, *(ROOT / 'launch').glob('*.py')]
    imported = set().union(*(top_level(imports(path)) for path in files))
    from_pip = {'rosbags', 'typer', 'rich', 'matplotlib', 'scipy', 'small_gicp', 'open3d',
                'rerun', 'dask', 'distributed', 'pyarrow', 'fsspec', 'aiohttp'}
    assert {MODULES_OF_KEYS.get(name, name) for name in imported - from_pip} <= keys


def test_setup_names_what_the_code_imports(requirements):
    named = {requirement.name for requirement in requirements}
    files = [path for path in SOURCES if 'ros' not in path.parts[len(ROOT.parts) + 1:]]
    imported = set().union(*(top_level(imports(path)) for path in files))
    assert {MODULES_OF_PACKAGES.get(name, name) for name in imported} <= named


def test_commands_can_be_imported(setup_arguments):
    pytest.importorskip('rclpy')
    for command in setup_arguments['entry_points']['console_scripts']:
        module, _, function = command.partition('=')[2].strip().partition(':')
        assert callable(getattr(importlib.import_module(module), function))


def test_each_command_has_a_launcher(setup_arguments):
    commands = setup_arguments['entry_points']['console_scripts']
    launchers = dict(setup_arguments['data_files'])['lib/aick_ros']
    assert {Path(launcher).name for launcher in launchers} == {
        command.split()[0] for command in commands}
    assert all(os.access(ROOT / launcher, os.X_OK) for launcher in launchers)
    assert len({(ROOT / launcher).read_text() for launcher in launchers}) == 1


@pytest.mark.parametrize('install', [shutil.copy, os.symlink])
def test_a_launcher_holds_the_signals_back(tmp_path, install):
    """Until the program can handle them: the mask is that of a program in bin."""
    for folder in ('bin', 'lib/aick_ros'):
        (tmp_path / folder).mkdir(parents=True)
    launcher, program = (tmp_path / folder / 'odom_node' for folder in ('lib/aick_ros', 'bin'))
    install(ROOT / 'scripts' / 'odom_node', launcher)
    program.write_text(f'#!{sys.executable}\nimport signal, sys\n'
                       'print(sorted(signal.pthread_sigmask(0, ())), sys.argv[1:])')
    program.chmod(0o755)
    arguments = ['--ros-args', '-p', 'a b', '']
    for command in ([launcher], ['./odom_node']):
        printed = subprocess.run([*command, *arguments], cwd=launcher.parent, text=True,
                                 check=True, stdout=subprocess.PIPE).stdout
        assert printed.strip() == f'{[signal.SIGINT, signal.SIGTERM]} {arguments}'


def test_pins_fit_the_requirements(requirements, pins):
    for requirement in requirements:
        assert pins[canonicalize_name(requirement.name)] in requirement.specifier, requirement


def test_the_oldest_pins_are_those_of_ubuntu_and_fit_the_requirements(setup_arguments):
    oldest = pins_of('oldest.txt')
    assert oldest['numpy'].startswith('1.26.')
    assert oldest['opencv-python-headless'].startswith('4.6.')
    for requirement in map(Requirement, [*setup_arguments['install_requires'], *(
            text for name in ('ros', 'eval', 'test')
            for text in setup_arguments['extras_require'][name])]):
        assert oldest[canonicalize_name(requirement.name)] in requirement.specifier, requirement


def test_everything_that_is_required_is_pinned(requirements, pins):
    """Follow the requirements of requirements through what is installed here."""
    waiting, seen = list(requirements), set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        assert name in pins, f'run tools/renew_pins.py: {name} has no pin'
        for extra in {'', *requirement.extras} - {e for n, e in seen if n == name}:
            seen.add((name, extra))
            waiting += [needed for needed in map(Requirement, requirements_of(name))
                        if needed.marker is None or needed.marker.evaluate({'extra': extra})]


def requirements_of(name):
    try:
        return importlib.metadata.requires(name) or []
    except importlib.metadata.PackageNotFoundError:
        return []
