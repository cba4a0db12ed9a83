# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The profile of Fast DDS is set by the name that the distribution reads, unless the user did."""

import os

import pytest

from aick_ros.ros.process import resources

VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


@pytest.fixture(params=['7.1.6', '9.1.2'])
def rclpy_version(request, monkeypatch):
    monkeypatch.setattr(resources, 'version', {'rclpy': request.param}.__getitem__)
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    return request.param


def test_the_profile_has_the_name_of_the_distribution(rclpy_version):
    resources.use_fastdds_profile()
    expected, other = VARIABLES if rclpy_version == '7.1.6' else VARIABLES[::-1]
    assert os.environ.pop(expected).endswith('config/fastdds.xml')
    assert other not in os.environ


@pytest.mark.parametrize('variable', VARIABLES)
def test_a_profile_of_the_user_stays(monkeypatch, rclpy_version, variable):
    monkeypatch.setenv(variable, '/mine.xml')
    resources.use_fastdds_profile()
    assert [os.environ.get(name) for name in VARIABLES if name in os.environ] == ['/mine.xml']
