# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node from its arguments to its end, in a process of its own."""

import subprocess
import sys

import pytest

RUN = """
import sys
from aick_ros.errors import InputError
from aick_ros.ros.parameter_node import ParameterNode
from aick_ros.ros.process.node_program import run_node

class Node(ParameterNode):
    def run(self):
        print('run')
        {run}

    def close(self):
        print('close')
        self.destroy_node()

def make(arguments):
    print(arguments.parameters, arguments.level)
    return Node(arguments)

run_node('odom_node', make)
"""


def outcome(run, *arguments):
    return subprocess.run([sys.executable, '-c', RUN.replace('{run}', run), *arguments],
                          capture_output=True, text=True)


def test_a_node_runs_and_is_closed(ros_domain):
    run = outcome('pass', '--Odom/Strategy', '0', '--uwarn')
    assert run.stdout.splitlines() == ["{'Odom/Strategy': '0'} warn", 'run', 'close'], run.stderr
    assert (run.returncode, run.stderr) == (0, '')


@pytest.mark.parametrize('error, code, said', [
    ("raise InputError('the\\nbag is damaged')", 2, 'odom_node: the bag is damaged\n'),
    ('raise ZeroDivisionError', 1, 'ZeroDivisionError\n')])
def test_it_is_closed_after_an_error_too(ros_domain, error, code, said):
    run = outcome(error)
    assert run.stdout.splitlines()[-2:] == ['run', 'close']
    assert run.returncode == code
    assert run.stderr.endswith(said)


def test_an_argument_that_means_nothing_ends_it_before_it_is_made(ros_domain):
    run = outcome('pass', '--nonsense')
    assert (run.returncode, run.stdout) == (2, '')
    assert run.stderr == 'odom_node: the argument --nonsense is not known: see --help\n'


def test_a_file_for_another_node_is_a_warning(ros_domain, tmp_path):
    file = tmp_path / 'other.yaml'
    file.write_text('other:\n  ros__parameters:\n    x: 1\n')
    run = outcome('pass', '--ros-args', '-r', '__ns:=/robot', '--params-file', str(file))
    assert run.returncode == 0
    assert f'nothing in {file} is read: it is for /other, and this node is /robot/odom_node' in (
        run.stdout + run.stderr)
    assert '[WARN]' in run.stdout + run.stderr
