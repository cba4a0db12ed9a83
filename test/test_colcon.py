# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The package as colcon and pip install it: `ros2 run` finds the node, and it runs."""

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NODE = 'lib/aick_ros/odom_node'
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine


def run(*command, **options):
    done = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          **options)
    assert done.returncode == 0, done.stdout
    return done.stdout


def copy_sources(target):
    """Copy what git has or would take."""
    if not (ROOT / '.git').exists():
        pytest.skip('no git checkout: which files belong to the package is not known')
    names = run('git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard', cwd=ROOT)
    for name in names.split('\0'):
        if (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)


def source(setup_file):
    """Return the environment of a shell that has sourced a file."""
    lines = run('bash', '-c', '. "$0" > /dev/null && env -0', setup_file)
    return dict(line.split('=', 1) for line in lines.split('\0') if line)


def install_with_colcon(sources, workspace):
    pytest.importorskip('colcon_core')
    run(sys.executable, '-m', 'colcon', '--log-base', workspace / 'log', 'build',
        '--base-paths', sources, '--build-base', workspace / 'build',
        '--install-base', workspace / 'install', cwd=workspace)
    return workspace / 'install' / 'aick_ros', source(workspace / 'install' / 'setup.bash')


def install_with_pip(sources, workspace):
    pytest.importorskip('pip')
    # not imported: it fails where distutils has been
    if tuple(map(int, version('setuptools').split('.')[:2])) < (70, 1):
        pytest.skip('setuptools older than 70.1')
    prefix = workspace / 'prefix'
    run(sys.executable, '-m', 'pip', 'install', '--no-deps', '--no-build-isolation',
        '--no-compile', '--ignore-installed', '--prefix', prefix, sources)
    packages = sysconfig.get_path('purelib', vars={'base': str(prefix)})
    inherited = os.environ.get('PYTHONPATH', '')
    return prefix, {**os.environ, 'PYTHONPATH': f'{packages}{os.pathsep}{inherited}'}


@pytest.fixture(scope='module', params=[install_with_colcon, install_with_pip])
def installed(request, tmp_path_factory):
    """
    Install the package; return the prefix and the environment to use it in.

    The kernels are compiled without optimisation, which takes a fifth of the time, and
    modules when they are imported.
    """
    workspace = tmp_path_factory.mktemp('workspace')
    copy_sources(workspace / 'aick_ros')
    compiler = workspace / 'cc'
    compiler.write_text('#!/bin/bash\nexec cc "${@/#-O3/-O0}"\n')
    compiler.chmod(0o755)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('CC', str(compiler))
        patch.setenv('PYTHONDONTWRITEBYTECODE', '1')
        return request.param(workspace / 'aick_ros', workspace)


@pytest.fixture
def observer(ros_domain):
    """Return a ROS node that sees who else is there."""
    rclpy = pytest.importorskip('rclpy')
    rclpy.init(args=[])
    node = rclpy.create_node('observer')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_the_installed_package_is_the_copy(installed):
    prefix, environment = installed
    file = run(sys.executable, '-c', 'import aick_ros; print(aick_ros.__file__)', env=environment,
               cwd=prefix)
    assert Path(file.strip()).is_relative_to(prefix)


def test_ros_finds_the_package(installed):
    prefix, _ = installed
    for executable in (NODE, 'lib/aick_ros/bag_player', 'bin/aick'):
        assert os.access(prefix / executable, os.X_OK)
    for file in ('ament_index/resource_index/packages/aick_ros', 'aick_ros/package.xml',
                 *(f'aick_ros/{path.relative_to(ROOT)}' for folder in ('config', 'launch')
                   for path in (ROOT / folder).rglob('*.*') if '__pycache__' not in path.parts)):
        assert (prefix / 'share' / file).is_file()


def test_the_installed_node_runs(installed, observer, tmp_path):
    prefix, environment = installed
    neighbourhood = {name: value for name, value in os.environ.items()
                     if name.startswith(('ROS_', 'FASTRTPS_'))}
    with (tmp_path / 'log').open('w+') as log:
        node = subprocess.Popen(
            [prefix / NODE, '--ros-args', '-r', '__node:=installed'], cwd=tmp_path,
            env={**environment, **neighbourhood}, stdout=log, stderr=subprocess.STDOUT)
        try:
            wait_until_seen('installed', observer, node, log)
            node.send_signal(signal.SIGINT)
            assert node.wait(PATIENCE) == 0
        finally:
            node.kill()
            node.wait()


def wait_until_seen(name, observer, process, log):
    deadline = time.monotonic() + PATIENCE
    while name not in observer.get_node_names():
        if process.poll() is not None or time.monotonic() > deadline:
            log.seek(0)
            pytest.fail(f'the node {name} was not seen, its log is: {log.read()}')
        time.sleep(0.05)
