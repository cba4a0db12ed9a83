# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the nodes of RTAB-Map wait for in vain is said, and nothing where nobody does."""

import pytest
from nav_msgs.msg import Odometry
from rclpy.logging import LoggingSeverity
from std_srvs.srv import Empty

from aick_ros.ros.health import expectations
from aick_ros.ros.health.expectations import Expectations
from aick_ros.settings.node import NodeSettings

INSTALL = 'rtabmap_msgs is not installed: install it (apt install ros-jazzy-rtabmap-msgs)'


SERVICES = 'reset_odom', 'pause_odom', 'resume_odom', 'reset_odom_to_pose'


@pytest.fixture
def without_messages(monkeypatch):
    monkeypatch.setattr(expectations, 'OdomInfo', None)
    monkeypatch.setattr(expectations, 'ResetPose', None)


@pytest.fixture
def with_messages(monkeypatch):
    monkeypatch.setattr(expectations, 'OdomInfo', Odometry)  # any: that there is one is asked for
    monkeypatch.setattr(expectations, 'ResetPose', Empty)


@pytest.fixture
def watched(graph):
    """Make the expectations of a node by the names that another one subscribes to or calls."""
    def make(*used, name='odom_node', remap=(), **settings):
        node = graph.node(name, namespace='robot', cli_args=['--ros-args', *(
            argument for rule in remap for argument in ('-r', rule))])
        for topic_or_service in used:
            if topic_or_service.endswith(SERVICES):
                graph.beside.create_client(Empty, topic_or_service)
                graph.wait_until(lambda: node.count_clients(topic_or_service), 'the client')
            else:
                graph.beside.create_subscription(Odometry, topic_or_service, print, 1)
                graph.wait_until(lambda: node.count_subscribers(topic_or_service), 'who listens')
        return node, Expectations(node, NodeSettings(**settings))
    return make


@pytest.fixture
def complaint(watched):
    """Return a function from what is used in vain to what is said of it."""
    return lambda *used, **given: watched(*used, **given)[1].complaint()


@pytest.fixture
def differences(graph, watched):
    """Return a function from what is used to what is logged in two seconds."""
    def logged(*used, **settings):
        node, watched_by = watched(*used, **settings)
        watched_by.report_differences()
        watched_by.report_differences()
        lines = graph.log(node)
        assert {level for level, _ in lines} <= {LoggingSeverity.WARN}
        return [text for _, text in lines]
    return logged


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
def test_who_waits_in_vain_without_the_messages_is_told(
        complaint, without_messages, used, sentence):
    assert complaint(f'/robot/{used}') == sentence


@pytest.mark.parametrize('kind', ['raw', 'features', 'compressed'])
def test_sensor_data_are_published_in_no_form(complaint, with_messages, kind):
    assert f'/robot/odom_sensor_data/{kind}, which is not published' in complaint(
        f'/robot/odom_sensor_data/{kind}')


@pytest.mark.parametrize('used', ['odom_info', 'odom_rgbd_image', 'odom_node/reset_odom_to_pose'])
def test_with_the_messages_nobody_waits_in_vain(complaint, with_messages, used):
    assert complaint(f'/robot/{used}') == ''


@pytest.mark.parametrize('service', SERVICES)
def test_a_service_under_the_name_of_their_node_is_explained(
        graph, complaint, with_messages, service):
    called = f'/robot/rgbd_odometry/{service}'
    assert complaint(called) == (f'somebody calls {called}, but this node is odom_node: start it '
                                 'with -r __node:=rgbd_odometry')
    assert complaint(name='rgbd_odometry') == ''
    other = graph.node('theirs')
    other.create_service(Empty, called, print)
    graph.wait_until(lambda: other.count_services(called), 'an rgbd_odometry')
    assert complaint() == ''


def test_a_remapped_topic_is_watched_under_its_other_name(complaint, without_messages):
    assert '/info' in complaint('/info', remap=['odom_info:=/info'])


def test_what_a_remapped_topic_was_called_is_not_watched(complaint, without_messages):
    assert complaint('/robot/odom_info', remap=['odom_info:=/info']) == ''


def test_a_map_of_scans_stays_empty(differences):
    assert differences('/robot/odom_local_scan_map') == [
        'somebody subscribes to /robot/odom_local_scan_map, which stays empty: laser scans are '
        'not used here']


def test_the_covariance_that_rtabmap_reads_is_named(differences):
    [sentence] = differences('/robot/odom_info', '/robot/odom_info_lite')
    assert sentence.endswith('set twist_covariance to increment')


def test_the_covariance_that_rtabmap_reads_is_not_named_where_it_is_sent(differences):
    assert differences('/robot/odom_info', twist_covariance='increment') == []


def test_where_nobody_expects_anything_nothing_is_said(differences):
    assert differences() == []


def test_the_node_finds_who_waits_for_it(rig, start_node):
    """Through DDS, of names as they are after remapping."""
    rig.node.create_client(Empty, 'rgbd_odometry/reset_odom')
    rig.listen(Odometry, 'odom_local_scan_map', lambda message: None)
    node = start_node(wait=False)
    node.wait_for_log('somebody subscribes to /odom_local_scan_map')
    node.wait_for_log('somebody calls /rgbd_odometry/reset_odom, but this node is odom_node')
