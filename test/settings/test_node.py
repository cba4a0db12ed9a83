# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters of the node: booleans, poses and frame names."""

import pytest

from aick_ros.errors import InputError
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import with_values


def test_booleans_poses_and_names_are_accepted_as_text():
    node = with_values(NodeSettings(), {
        'publish_tf': 'false', 'camera_in_base': '0 0 1, 0 0 0 1', 'frame_id': 'camera'})
    assert node.publish_tf is False
    assert node.camera_in_base == (0, 0, 1, 0, 0, 0, 1)
    assert node.frame_id == 'camera'


@pytest.mark.parametrize('value', [1, 'yes', None])
def test_a_boolean_is_true_or_false_only(value):
    with pytest.raises(InputError, match='is not true or false'):
        with_values(NodeSettings(), {'publish_tf': value})


@pytest.mark.parametrize('text', ['[0, 0, 1, 0, 0, 0, 1]', ' [0.0 0.0 1.0 0 0 0 1] ',
                                  '0 0 1 0 0 0 1'])
def test_a_list_as_text_may_have_brackets(text):
    node = with_values(NodeSettings(), {'camera_in_base': text})
    assert node.camera_in_base == (0, 0, 1, 0, 0, 0, 1)


@pytest.mark.parametrize('text', ['[[0, 0]', '[0, 0], 0', '[a]'])
def test_what_is_no_list_as_text_is_rejected(text):
    with pytest.raises(InputError, match='is not a list of numbers'):
        with_values(NodeSettings(), {'camera_in_base': text})
