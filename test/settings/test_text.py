# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters as YAML and Markdown, parsed back and compared with the settings."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
import yaml

from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import parameter, parameters, values, with_values
from aick_ros.settings.presets import preset
from aick_ros.settings.text import config_text, parameter_table, scalar_text


def as_in_yaml(group):
    """Return values by name, tuples as the lists that they are in YAML."""
    return {name: list(value) if isinstance(value, tuple) else value
            for name, value in group.items()}


def read(text):
    return yaml.safe_load(text)['/**']['ros__parameters']


@pytest.mark.parametrize('group', [Settings(), preset('paper-full'), NodeSettings(),
                                   NodeSettings(frame_id="it's: #1", camera_in_base=(0, 1e-7, 2))])
def test_yaml_is_parsed_back_with_values_and_types(group):
    content = read(config_text(group, title='Made by a test.'))
    for p in parameters(group):
        if p.default == ():
            assert p.name not in content  # ROS takes no empty list
        else:
            value = content[p.name]
            assert type(value) is (list if p.type is tuple else p.type)
            assert (tuple(value) if p.type is tuple else value) == p.default
    assert with_values(type(group)(), content) == group


def test_small_and_large_numbers_stay_numbers():
    settings = with_values(Settings(), {'sensor.depth_sigma': 1e-6, 'odometry.max_speed': 1e3})
    content = read(config_text(settings))
    assert content['sensor.depth_sigma'] == 1e-6
    assert content['odometry.max_speed'] == 1000.0


def test_commented_values_are_written_but_not_read():
    text = config_text(NodeSettings(), commented=Settings())
    assert read(text).keys() <= values(NodeSettings()).keys()
    lines = [line.replace('#', '', 1) if line.startswith('    #') and ': ' in line
             and not line.startswith('    # ') else line for line in text.splitlines()]
    content = read('\n'.join(line for line in lines if 'camera_in_base' not in line))
    assert {name: content[name] for name in values(Settings())} == as_in_yaml(values(Settings()))


def test_each_parameter_has_its_description_and_range():
    text = ' '.join(config_text(Settings()).replace('    # ', '').split())
    for p in parameters(Settings()):
        assert ' '.join(p.description.split()) in text
        assert p.range_text in text


def test_lines_are_short_and_the_last_one_is_complete():
    text = config_text(NodeSettings(), Settings(), title='long ' * 60)
    assert max(map(len, text.splitlines())) <= 99
    assert text.endswith('\n')


def test_table_has_a_row_for_each_parameter():
    head, rule, *rows = parameter_table(Settings()).splitlines()
    known = list(parameters(Settings()))
    assert len(rows) == len(known)
    for row, p in zip(rows, known):
        name, default, range_text, meaning = (cell.strip() for cell in row.strip('|').split('|'))
        assert name == f'`{p.name}`'
        assert {'': yaml.safe_load(default.strip('`'))} == as_in_yaml({'': p.default})
        assert (range_text, meaning) == (p.range_text, p.description)
    assert head.count('|') == rule.count('|') == 5


def test_vertical_bars_are_escaped_in_the_table():
    @dataclass(frozen=True)
    class Barred:
        ratio: float = parameter(0.5, 'a | b', unit='m')

    assert parameter_table(Barred()).splitlines()[2].endswith('| a \\| b [m] |')


@pytest.mark.parametrize('value, text', [
    (True, 'true'), (False, 'false'), (3, '3'), (0.5, '0.5'), (1e-5, '1.0e-05'), (1e22, '1.0e+22'),
    (1.5e-7, '1.5e-07'), (-0.25, '-0.25'), ((), '[]'), ((1, 0.5), '[1.0, 0.5]'),
    ("it's", "'it''s'"),
    ('', "''"), ('true', "'true'"), ('3', "'3'")])
def test_values_are_written_so_that_their_type_is_seen(value, text):
    assert scalar_text(value) == text
    read_back = yaml.safe_load(text)
    assert (tuple(read_back) if isinstance(value, tuple) else read_back) == value
    assert isinstance(value, tuple) or type(read_back) is type(value)


def test_a_unit_without_a_range_stands_in_the_description():
    @dataclass(frozen=True)
    class Some:
        pose: tuple[float, ...] = parameter((), 'A pose.', unit='m')
        width: float = parameter(2.0, 'A width.', unit='m', minimum=0.0, maximum=5.0)

    assert config_text(Some()) == (
        '/**:\n  ros__parameters:\n    # A pose. [m]\n    #pose: []\n    # A width. [0 to 5 m]\n'
        '    width: 2.0\n')
