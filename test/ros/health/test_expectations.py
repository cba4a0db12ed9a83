# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the nodes of RTAB-Map wait for in vain is said, and nothing where nobody does."""

from types import SimpleNamespace

import pytest
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

from aick_ros.ros.health import expectations
from aick_ros.ros.health.expectations import Expectations
from aick_ros.settings.node import NodeSettings

INSTALL = 'rtabmap_msgs is not installed: install it (apt install ros-jazzy-rtabmap-msgs)'


class Graph:
    """A node among others: who uses which topic or service, and which names are remapped."""

    def __init__(self, used=(), served=(), remapped=(), name='odom_node'):
        self._used, self._served, self._remapped = used, served, dict(remapped)
        self.get_name = lambda: name
        self.warnings = []
        self.get_logger = lambda: SimpleNamespace(warning=self.warnings.append)
        self.count_clients = self.count_subscribers = self.count_publishers = used.count
        self.count_services = served.count

    def resolve_topic_name(self, name, only_expand=False):
        full = '/robot/' + name.replace('~', self.get_name())
        return full if only_expand else self._remapped.get(name, full)

    resolve_service_name = resolve_topic_name


@pytest.fixture
def without_messages(monkeypatch):
    monkeypatch.setattr(expectations, 'OdomInfo', None)
    monkeypatch.setattr(expectations, 'ResetPose', None)


@pytest.fixture
def with_messages(monkeypatch):
    monkeypatch.setattr(expectations, 'OdomInfo', object)
    monkeypatch.setattr(expectations, 'ResetPose', object)


def complaint(*used, **graph):
    return Expectations(Graph(used, **graph), NodeSettings()).complaint()


def differences(*used, twist_covariance='velocity', **graph):
    """Return what is logged in two seconds."""
    node = Graph(used, **graph)
    watched = Expectations(node, NodeSettings(twist_covariance=twist_covariance))
    watched.report_differences()
    watched.report_differences()
    return node.warnings


@pytest.mark.parametrize('used, sentence', [
    ('odom_sensor_data/raw', 'somebody subscribes to /robot/odom_sensor_data/raw, which is not '
     'published here: subscribe to odom_rgbd_image (subscribe_rgbd) in its place'),
    ('odom_info', f'somebody subscribes to /robot/odom_info, but {INSTALL}, or set '
     'subscribe_odom_info to false there'),
    ('odom_info_lite', f'somebody subscribes to /robot/odom_info_lite, but {INSTALL}, or set '
     'subscribe_odom_info to false there'),
    ('odom_rgbd_image', f'somebody subscribes to /robot/odom_rgbd_image, but {INSTALL}'),
    ('odom_node/reset_odom_to_pose', 'somebody calls /robot/odom_node/reset_odom_to_pose, but '
     f'{INSTALL}, or publish the pose on set_pose'),
    ('odom', ''), ('odom_node/reset_odom', '')])
def test_who_waits_in_vain_without_the_messages_is_told(without_messages, used, sentence):
    assert complaint(f'/robot/{used}') == sentence


@pytest.mark.parametrize('kind', ['raw', 'features', 'compressed'])
def test_sensor_data_are_published_in_no_form(with_messages, kind):
    assert f'/robot/odom_sensor_data/{kind}, which is not published' in complaint(
        f'/robot/odom_sensor_data/{kind}')


@pytest.mark.parametrize('used', ['odom_info', 'odom_rgbd_image', 'odom_node/reset_odom_to_pose'])
def test_with_the_messages_nobody_waits_in_vain(with_messages, used):
    assert complaint(f'/robot/{used}') == ''


@pytest.mark.parametrize('service', ['reset_odom', 'pause_odom', 'resume_odom',
                                     'reset_odom_to_pose'])
def test_a_service_under_the_name_of_their_node_is_explained(with_messages, service):
    called = f'/robot/rgbd_odometry/{service}'
    assert complaint(called) == (f'somebody calls {called}, but this node is odom_node: start it '
                                 'with -r __node:=rgbd_odometry')
    assert complaint(called, name='rgbd_odometry') == ''
    assert complaint(called, served=[called]) == ''  # an rgbd_odometry is there, too


def test_a_remapped_topic_is_watched_under_its_other_name(without_messages):
    assert '/info' in complaint('/info', remapped={'odom_info': '/info'})
    assert complaint('/robot/odom_info', remapped={'odom_info': '/info'}) == ''


def test_a_map_of_scans_stays_empty():
    assert differences('/robot/odom_local_scan_map') == [
        'somebody subscribes to /robot/odom_local_scan_map, which stays empty: laser scans are '
        'not used here']


def test_the_covariance_that_rtabmap_reads_is_named():
    used = ['/robot/odom_info', '/robot/odom_info_lite']
    [sentence] = differences(*used)
    assert sentence.endswith('set twist_covariance to increment')
    assert differences(*used, twist_covariance='increment') == []


def test_where_nobody_expects_anything_nothing_is_said():
    assert differences() == []


def test_the_node_finds_who_waits_for_it(rig, start_node):
    """Through DDS, of names as they are after remapping."""
    rig.node.create_client(Empty, 'rgbd_odometry/reset_odom')
    rig.listen(Odometry, 'odom_local_scan_map', lambda message: None)
    node = start_node(wait=False)
    node.wait_for_log('somebody subscribes to /odom_local_scan_map')
    node.wait_for_log('somebody calls /rgbd_odometry/reset_odom, but this node is odom_node')
