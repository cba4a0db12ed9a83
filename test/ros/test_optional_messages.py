# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of packages that may be missing, and the remedies that are given then."""

import runpy
import sys

import pytest


@pytest.mark.parametrize('is_missing', [False, True])
def test_without_tf2_msgs_the_remedy_is_its_installation(monkeypatch, is_missing):
    if is_missing:
        monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', None)
    names = runpy.run_module('aick_ros.ros.tf_messages')
    assert (names['TFMessage'] is None) is is_missing
    assert names['TF_REMEDY'] == (
        'tf2_msgs is not installed, so TF cannot be received' if is_missing else
        'publish the static transform between them')


def test_without_rtabmap_msgs_there_are_none_of_its_messages(monkeypatch):
    monkeypatch.setitem(sys.modules, 'rtabmap_msgs', None)
    monkeypatch.setitem(sys.modules, 'rtabmap_msgs.msg', None)
    names = runpy.run_module('aick_ros.ros.rtabmap_messages')
    assert [names[name] for name in ('OdomInfo', 'Point2f', 'RGBDImage', 'RGBDImages',
                                     'ResetPose')] == 5 * [None]
    assert set(names['__all__']) <= names.keys()
    assert 'apt install ros-jazzy-rtabmap-msgs' in names['INSTALL_RTABMAP_MSGS']
