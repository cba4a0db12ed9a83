# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""README and config say what the code says."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.text import parameter_table

ROOT = Path(__file__).parents[1]
README = (ROOT / 'README.md').read_text()


def aick(*arguments):
    return subprocess.run([sys.executable, '-m', 'aick_ros', *arguments], capture_output=True,
                          text=True, check=True).stdout


@pytest.mark.parametrize('group', [Settings(), NodeSettings()], ids=['algorithm', 'node'])
def test_the_parameter_tables_are_those_of_the_settings(group):
    assert parameter_table(group) in README


def test_the_configuration_is_what_the_command_prints():
    assert (ROOT / 'config' / 'odom_node.yaml').read_text() == aick(
        'parameters', '--format', 'yaml')


def test_every_command_and_option_named_exists():
    for command in set(re.findall(r'^\| `aick (\w+)', README, re.MULTILINE)):
        assert 'Usage' in aick(command, '--help')
    options = aick('evaluate', '--help') + aick('replay', '--help') + aick('simulate', '--help')
    for option in ('--preset', '--config', '--set', '--gaps', '--json', '--perfect'):
        assert option in options


def test_the_library_example_runs(tmp_path):
    example = re.search(r'```python\n(.*?)```', README, re.DOTALL).group(1)
    short = example.replace("open_source('synthetic:1').frames(raise_damage)",
                            "[open_source('synthetic:1').frame(0)]")
    assert short != example
    run = subprocess.run([sys.executable, '-c', short], capture_output=True, text=True)
    assert run.stdout.startswith('FIRST_FRAME'), run.stderr


def test_linked_files_are_there():
    for target in re.findall(r'\]\(([^)#:]+)\)', README):
        assert (ROOT / target).exists(), target
