# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The programs: which module each runs, and what is said where it cannot."""

import subprocess
import sys

import pytest

from aick_ros.borders import no_memory
from aick_ros.ros.playback.node_process import NODE_COMMAND

PROGRAMS = {'odom_node': 'aick_ros.ros.odom_node',
            'odom_lifecycle_node': 'aick_ros.ros.odom_lifecycle_node',
            'bag_player': 'aick_ros.ros.playback.bag_player'}


def outcome(program, setup='', *arguments):
    """Run a program after a line of setup, with arguments."""
    command = (f'import sys; {setup}\nfrom aick_ros.ros.process import entry_points as e\n'
               + program)
    return subprocess.run([sys.executable, '-c', command, *arguments], capture_output=True)


def test_each_program_runs_its_own_module_with_the_signals_held_back():
    run = outcome(f"""
import signal
from types import SimpleNamespace
imported = []
def module(name):
    imported.append((name, sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ()))))
    return SimpleNamespace(main=lambda: print(*imported.pop(), sep=' '))
e.import_module = module
for name in {list(PROGRAMS)}:
    getattr(e, name)()
""")
    held = '[<Signals.SIGINT: 2>, <Signals.SIGTERM: 15>]'
    assert run.stdout.decode().splitlines() == [
        f'{module} {held}' for module in PROGRAMS.values()], run.stderr


@pytest.mark.parametrize('program, missing, sentence', [
    ('odom_node', 'rclpy', "rclpy is not installed: source a ROS 2 Jazzy workspace, or pip "
                           "install '.[ros]' in the folder of aick_ros"),
    ('odom_lifecycle_node', 'cv2', 'cv2 is not installed: apt install python3-opencv'),
    ('odom_node', 'numpy', 'numpy is not installed: apt install python3-numpy'),
    ('bag_player', 'rosbags.rosbag2', 'rosbags.rosbag2 is not installed: pip install rosbags')])
def test_a_missing_package_is_named_with_its_remedy(program, missing, sentence):
    run = outcome(f'e.{program}()', f'sys.modules[{missing!r}] = None')
    assert (run.returncode, run.stderr.decode()) == (2, f'{program}: {sentence}\n')


@pytest.mark.parametrize('limit, allowed, sentence', [
    ('AS', 900_000_000, 'the memory of a process is limited to 900 MB (ulimit -v), the libraries '
     'of this program require 1000 MB: raise the limit'),
    ('NOFILE', 31, 'a process may have 31 open files (ulimit -n), ROS and its libraries require '
     '32: raise the limit')])
def test_limits_under_which_libraries_abort_are_named(limit, allowed, sentence):
    run = outcome('e.odom_node()', f'import resource as r; r.setrlimit(r.RLIMIT_{limit}, '
                                   f'({allowed}, {allowed}))')
    assert (run.returncode, run.stderr.decode()) == (2, f'odom_node: {sentence}\n')


@pytest.mark.parametrize('error', [
    MemoryError(), ImportError('libblas.so: failed to map segment from shared object')], ids=repr)
def test_an_import_without_memory_is_one_sentence(error):
    run = outcome(f"""
def module(name):
    raise {error!r}
e.import_module = module
e.odom_node()
""")
    assert (run.returncode, run.stderr.decode()) == (
        2, f'odom_node: {no_memory.SENTENCE}\n')


def test_an_import_that_fails_otherwise_is_a_defect():
    run = outcome('e.import_module = lambda name: exec("raise ImportError(name)")\ne.odom_node()')
    assert run.returncode == 1
    assert b'ImportError: aick_ros.ros.odom_node' in run.stderr


@pytest.mark.parametrize('redirection', ['>&-', '2>&-', '>&- 2>&- <&-', '2>/dev/full',
                                         '>/dev/full 2>/dev/full'])
def test_where_the_sentence_cannot_be_written_the_code_stays(redirection):
    done = subprocess.run(['sh', '-c', f'exec "$@" {redirection}', 'sh', sys.executable, '-c',
                           'from aick_ros.ros.process import entry_points as e; e.odom_node()',
                           '--params-file', '/nowhere'], capture_output=True, timeout=120)
    assert done.returncode == 2
    assert b'Traceback' not in done.stderr


def test_a_help_that_cannot_be_written_is_one_sentence():
    done = subprocess.run(['sh', '-c', 'exec "$@" >/dev/full', 'sh', *NODE_COMMAND, '--help'],
                          capture_output=True, timeout=120)
    assert (done.returncode, done.stderr.decode()) == (
        2, 'odom_node: the help cannot be written: No space left on device\n')


def test_a_module_of_our_own_that_is_missing_is_a_defect():
    run = outcome('e.bag_player()', "sys.modules['aick_ros.ros.playback.bag_player'] = None")
    assert run.returncode == 1
    assert b'ModuleNotFoundError' in run.stderr


def test_an_argument_that_is_not_utf_8_is_named():
    run = outcome('e.odom_node()', '', b'--params-file', b'\xff.yaml')
    assert run.returncode == 2
    assert run.stderr.startswith(
        rb'odom_node: the argument \xff.yaml is not UTF-8, as ROS requires: rename')
    assert run.stderr.count(b'\n') == 1


@pytest.mark.parametrize('name', ['odom_node', 'bag_player'])
def test_a_parameter_file_that_is_missing_is_named(name):
    run = outcome(f'e.{name}()', '', '--ros-args', '--params-file', '/none/a.yaml')
    assert run.returncode == 2
    assert run.stderr.startswith(f'{name}: cannot read the parameters /none/a.yaml'.encode())


@pytest.mark.parametrize('setup, said', [
    ("import os; os.environ['ROS_DOMAIN_ID'] = '999'", b'odom_node: ROS_DOMAIN_ID is 999: at mo'),
    ("import os; os.environ['RMW_IMPLEMENTATION'] = 'x'", b'odom_node: RMW_IMPLEMENTATION is x, '),
    ("sys.argv[1:] = ['--params-file', '/none/a.yaml']", b'odom_node: cannot read the param')])
def test_what_would_end_ros_is_rejected_before_it_is_imported(setup, said):
    run = outcome('e.import_module = lambda name: print("imported")\ne.odom_node()', setup)
    assert (run.returncode, run.stdout) == (2, b'')
    assert run.stderr.startswith(said) and run.stderr.count(b'\n') == 1
