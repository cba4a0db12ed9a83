# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files beside the code name what the node has, and are all installed."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

from aick_ros.settings import Settings
from aick_ros.settings.parameter import values, with_values

ROOT = Path(__file__).parents[1]
CAMERAS = sorted((ROOT / 'config' / 'cameras').glob('*.yaml'))
POLICY = ROOT / 'config' / 'sros2' / 'odom_node.policy.xml'


@pytest.mark.parametrize('file', CAMERAS, ids=lambda file: file.stem)
def test_each_camera_gives_all_topics_by_their_full_names(file):
    remappings = yaml.safe_load(file.read_text())['remappings']
    assert {'rgb/image', 'depth/image', 'rgb/camera_info'} <= set(remappings)
    assert all(topic.startswith('/') for topic in remappings.values())
    assert len(set(remappings.values())) == len(remappings)


@pytest.mark.parametrize('file', CAMERAS, ids=lambda file: file.stem)
def test_each_camera_gives_parameters_that_the_node_has(file):
    content = yaml.safe_load(file.read_text())
    given = content.get('/**', {}).get('ros__parameters', {})
    settings = with_values(Settings(), given)
    assert {name: values(settings)[name] for name in given} == given


def test_rviz_shows_what_the_node_publishes():
    displays = yaml.safe_load(
        (ROOT / 'config' / 'odometry.rviz').read_text())['Visualization Manager']['Displays']
    topics = {display['Topic']['Value'] for display in displays if 'Topic' in display}
    assert topics == {'path', 'odom', 'keypoints', 'debug_image'}


def test_the_policy_denies_nothing_and_has_no_wildcards():
    text = ElementTree.tostring(ElementTree.parse(POLICY).getroot(), encoding='unicode')
    assert 'DENY' not in text
    assert '*' not in text
