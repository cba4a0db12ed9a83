# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The parameters as the command prints them."""

import yaml

from aick_ros.cli.input.options import settings_from
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import values
from aick_ros.settings.presets import preset
from aick_ros.settings.text import parameter_table


def test_tables_of_algorithm_and_node(aick):
    outcome = aick('parameters')
    assert outcome.code == 0
    algorithm, node = (parameter_table(group) for group in (Settings(), NodeSettings()))
    assert outcome.out == (f'Algorithm (also --set NAME=VALUE):\n\n{algorithm}\nNode:\n\n{node}')


def test_yaml_is_a_file_for_node_and_command(aick, tmp_path):
    outcome = aick('parameters', '--format', 'yaml')
    file = tmp_path / 'odom_node.yaml'
    file.write_text(outcome.out)
    given = yaml.safe_load(outcome.out)['/**']['ros__parameters']
    assert given == {name: value for name, value in values(NodeSettings()).items() if value != ()}
    assert 'aick parameters --format yaml' in ' '.join(outcome.out.split('/**')[0].split())
    # a preset still counts
    assert settings_from('paper-full', file, None) == preset('paper-full')
