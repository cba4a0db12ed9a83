# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The profile of Fast DDS is set by the name that the distribution reads, unless the user did."""

import os

import pytest
from ament_index_python.packages import PackageNotFoundError

from aick_ros.errors import InputError
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
    assert resources.fastdds_profile() == {}
    resources.use_fastdds_profile()
    assert [os.environ.get(name) for name in VARIABLES if name in os.environ] == ['/mine.xml']


@pytest.fixture
def places(monkeypatch, tmp_path):
    """Return the folders in which files are looked for, in order; ament knows the first one."""
    folders = [tmp_path / 'share', tmp_path / 'prefix' / 'share' / 'aick_ros', tmp_path / 'source']
    monkeypatch.setattr(resources, 'get_package_share_directory', lambda name: {
        'aick_ros': str(folders[0])}[name])
    monkeypatch.setattr(resources.sys, 'prefix', str(tmp_path / 'prefix'))
    monkeypatch.setattr(resources, '__file__', str(folders[2] / 'aick_ros/ros/process/x.py'))
    for folder in folders:
        (folder / 'config').mkdir(parents=True)
    return folders


def test_a_file_is_that_of_the_installed_package_before_that_of_its_source(places):
    for folder in reversed(places):
        (folder / 'config' / 'a.yaml').touch()
        assert resources.config_file('a.yaml') == folder / 'config' / 'a.yaml'


@pytest.mark.parametrize('error', [PackageNotFoundError('aick_ros'), OSError])
def test_without_a_package_of_ament_the_others_are_looked_at(places, monkeypatch, error):
    def fail(name):
        raise error
    monkeypatch.setattr(resources, 'get_package_share_directory', fail)
    (places[0] / 'config' / 'a.yaml').touch()
    with pytest.raises(InputError) as caught:
        resources.config_file('a.yaml')
    assert str(caught.value) == (
        f'config/a.yaml is in none of {places[1]}, {places[2]}: install aick_ros again')


def test_where_rclpy_has_no_version_the_name_is_that_of_jazzy(monkeypatch):
    def fail(name):
        raise resources.NotInstalled
    monkeypatch.setattr(resources, 'version', fail)
    assert resources.profiles_variable() == VARIABLES[0]


@pytest.mark.parametrize('number, name', [('7.9', VARIABLES[0]), ('8.0', VARIABLES[1]),
                                          ('10.1', VARIABLES[1])])
def test_the_name_changed_after_jazzy(monkeypatch, number, name):
    monkeypatch.setattr(resources, 'version', {'rclpy': number}.__getitem__)
    assert resources.profiles_variable() == name
