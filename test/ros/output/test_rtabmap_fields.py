# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The fields of the messages for RTAB-Map, without DDS and without rtabmap_msgs."""

from types import SimpleNamespace

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import BaseMotion, BaseState, BaseUpdate
from aick_ros.registration.status import Status
from aick_ros.ros.conversions import from_transform, to_stamp
from aick_ros.ros.output import rgbd_image, rtabmap
from aick_ros.ros.output.rtabmap import Registered, RtabmapTopics
from aick_ros.ros.output.views import positions_of

CAMERA = Camera(8, 6, 10.0, 11.0, 3.5, 2.5)
STAMP = 5_250_000_000
COVARIANCE = np.diag([1e-4, 2e-4, 3e-4, 4e-5, 5e-5, 6e-5])
SOURCE, TARGET = (np.random.default_rng(seed).uniform(0, 8, (4, 2)) for seed in (1, 2))
MATCHES = np.array([(3, 0), (1, 2)])


class Publisher(list):
    """Keeps what is published; ``subscribers`` listen."""

    subscribers = 1
    publish = list.append

    def get_subscription_count(self):
        return self.subscribers


class Node:
    """Keeps publishers by their topics, and the types of their messages."""

    def __init__(self):
        self.published, self.kinds = {}, {}

    def create_publisher(self, kind, topic, qos):
        assert qos == 10
        self.kinds[topic] = kind
        return self.published.setdefault(topic, Publisher())


@pytest.fixture
def topics(monkeypatch):
    """Return the topics on a node, with messages that take any field."""
    for name in ('OdomInfo', 'Point2f', 'RGBDImage'):
        monkeypatch.setattr(rtabmap, name, SimpleNamespace)
    monkeypatch.setattr(rgbd_image, 'RGBDImage', SimpleNamespace)
    node = Node()
    return RtabmapTopics(node, 'odom', lambda: np.ones((2, 3))), node.published


FRAME = RgbdFrame(STAMP, np.zeros((6, 8), np.uint8), np.ones((6, 8), np.float32), CAMERA,
                  STAMP + 7)


POSITIONS = np.random.default_rng(3).normal(0, 1, (4, 3))
T_ODOM_BASE = se3.exp([1.0, -2.0, 0.5, 0.3, -0.2, 1.1])


def registered(state=BaseState.TRACKED, forward=0.1, seconds=0.2, frame=FRAME, pixels=SOURCE):
    """Return a frame after a motion of the base straight on."""
    keypoints = SimpleNamespace(pixels=pixels, positions=POSITIONS)
    prepared = SimpleNamespace(frame=frame, keypoints=keypoints)
    is_tracked = state is BaseState.TRACKED
    increment = Increment(PoseWithCovariance(np.eye(4), COVARIANCE), seconds)
    update = OdometryUpdate(
        STAMP, Status.OK if is_tracked else Status.TOO_FEW_MATCHES, '',
        PoseWithCovariance.identity(), prepared, increment=increment if is_tracked else None,
        reference=SimpleNamespace(pixels=TARGET[:3]) if is_tracked else None,
        matches=MATCHES if is_tracked else MATCHES[:0], support=17 if is_tracked else 0,
        timing={'features': 20.0, 'total': 35.0})
    motion = BaseMotion(np.array([forward / seconds, 0, 0, 0, 0, 0]), COVARIANCE, seconds)
    base = BaseUpdate(STAMP, state, PoseWithCovariance(T_ODOM_BASE),
                      motion if is_tracked else None)
    return Registered(update, base, se3.exp([0, 0, 1, 0, 0, 0]), 'optical')


def test_times_are_seconds_and_counts_those_of_the_frame(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered())
    info, = published['odom_info']
    assert (info.time_estimation, info.interval, info.stamp) == pytest.approx((0.035, 0.2, 5.25))
    assert (info.matches, info.inliers, info.features, info.local_map_size) == (2, 17, 4, 3)
    assert to_stamp(info.header.stamp) == STAMP and info.header.frame_id == 'odom'
    np.testing.assert_array_equal(np.reshape(info.covariance, (6, 6)), COVARIANCE)
    assert info.transform.translation.x == pytest.approx(0.1)


def test_corners_are_those_of_the_matches(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered())
    info, lite = published['odom_info'][0], published['odom_info_lite'][0]
    np.testing.assert_allclose([(p.x, p.y) for p in info.new_corners], SOURCE[[3, 1]])
    np.testing.assert_allclose([(p.x, p.y) for p in info.ref_corners], TARGET[[0, 2]])
    assert info.corner_inliers == [0, 1]
    assert not {'new_corners', 'ref_corners', 'corner_inliers'} & set(vars(lite))
    assert (lite.local_map_size, lite.matches) == (3, 2)


def test_corners_lie_on_the_image_that_is_sent(topics):
    """On the spots of a distorted image, which is rectified: found in it by their brightness."""
    rtabmap_topics, published = topics
    camera = Camera(120, 90, 90.0, 90.0, 59.5, 44.5, 'plumb_bob', (-0.3, 0.05, 0.01, -0.02))
    pixels = np.array([[20.0, 15.0], [100.0, 20.0], [25.0, 70.0], [90.0, 75.0]])
    v, u = np.mgrid[:90, :120]
    image = sum(200 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / 8) for x, y in pixels)
    frame = RgbdFrame(STAMP, image.astype(np.uint8), np.ones((90, 120), np.float32), camera)
    rtabmap_topics.show(registered(frame=frame, pixels=pixels))
    info, = published['odom_info']
    sent = published['odom_rgbd_image'][0].rgb
    sent = np.array(sent.data).reshape(sent.height, sent.width)
    for corner, pixel in zip(info.new_corners, pixels[MATCHES[:, 0]]):
        near = sent * (np.hypot(u - corner.x, v - corner.y) < 8)
        assert np.hypot(*(pixel - (corner.x, corner.y))) > 1
        assert corner.x == pytest.approx((near * u).sum() / near.sum(), abs=0.3)
        assert corner.y == pytest.approx((near * v).sum() / near.sum(), abs=0.3)


@pytest.mark.parametrize('state', [BaseState.LOST, BaseState.PREDICTED])
def test_without_a_measurement_the_camera_is_lost_and_its_motion_unknown(topics, state):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered(state))
    info, = published['odom_info']
    assert info.lost
    np.testing.assert_array_equal(np.reshape(info.covariance, (6, 6)), 9999.0 * np.eye(6))
    rotation = info.transform.rotation
    assert (rotation.x, rotation.y, rotation.z, rotation.w) == (0.0, 0.0, 0.0, 0.0)


def test_the_distance_is_the_sum_of_the_motions_since_the_reset(topics):
    rtabmap_topics, published = topics
    for forward in (0.1, -0.1, 0.3):
        rtabmap_topics.show(registered(forward=forward))
    rtabmap_topics.show(registered(BaseState.LOST))
    assert [info.distance_travelled for info in published['odom_info']] == pytest.approx(
        [0.1, 0.2, 0.5, 0.5])
    rtabmap_topics.reset()
    rtabmap_topics.show(registered(forward=0.4))
    assert published['odom_info'][-1].distance_travelled == pytest.approx(0.4)


def test_the_motion_is_that_of_the_base_and_what_is_not_known_is_null(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered(forward=0.1))
    info, = published['odom_info']
    assert not info.lost
    assert (info.type, info.local_key_frames) == (1, 1)  # frame to frame, by definition
    for transform in (info.transform, info.transform_filtered):
        np.testing.assert_allclose(from_transform(transform), se3.exp([0.1, 0, 0, 0, 0, 0]),
                                   atol=1e-12)
    for transform in (info.transform_ground_truth, info.guess):
        rotation = transform.rotation
        assert (rotation.x, rotation.y, rotation.z, rotation.w) == (0.0, 0.0, 0.0, 0.0)


def test_the_turn_of_the_base_is_not_reversed():
    T = se3.exp([0.3, -0.1, 0.2, 0.3, 0.2, -0.1])
    np.testing.assert_allclose(from_transform(rtabmap._transform(T)), T, atol=1e-12)


def test_without_a_reference_nothing_is_said_of_it(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered(BaseState.LOST))
    info, = published['odom_info']
    assert not {'interval', 'local_map_size', 'local_key_frames', 'new_corners', 'ref_corners',
                'corner_inliers'} & set(vars(info))
    assert (info.matches, info.inliers) == (0, 0)


def test_keypoints_and_local_map_are_sent_in_the_frame_of_the_odometry(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered())
    T_odom_camera = T_ODOM_BASE @ se3.exp([0, 0, 1, 0, 0, 0])
    for topic, points in (('odom_last_frame', POSITIONS), ('odom_local_map', np.ones((2, 3)))):
        cloud, = published[topic]
        assert to_stamp(cloud.header.stamp) == STAMP and cloud.header.frame_id == 'odom'
        np.testing.assert_allclose(positions_of(cloud), se3.transform(T_odom_camera, points),
                                   atol=1e-5)
    rtabmap_topics.show(registered(BaseState.LOST))
    assert len(published['odom_last_frame']) == len(published['odom_local_map']) == 1
    assert len(published['odom_rgbd_image']) == 2  # it is lost, not blind


def test_nothing_is_made_for_nobody(topics, monkeypatch):
    rtabmap_topics, published = topics
    for publisher in published.values():
        publisher.subscribers = 0
    for name in ('OdomInfo', 'rgbd_image', 'point_cloud'):
        monkeypatch.setattr(rtabmap, name, None)
    rtabmap_topics.show(registered(forward=0.1))
    assert not any(published.values())
    monkeypatch.setattr(rtabmap, 'OdomInfo', SimpleNamespace)
    published['odom_info'].subscribers = 1
    rtabmap_topics.show(registered(forward=0.2))
    # what was travelled meanwhile counts
    assert published['odom_info'][0].distance_travelled == pytest.approx(0.3)
    assert published['odom_info_lite'] == []


def test_each_topic_has_its_type_and_without_the_messages_there_are_clouds_alone(monkeypatch):
    info, image = type('Info', (), {}), type('Image', (), {})
    monkeypatch.setattr(rtabmap, 'OdomInfo', info)
    monkeypatch.setattr(rtabmap, 'RGBDImage', image)
    clouds = {'odom_last_frame': PointCloud2, 'odom_local_map': PointCloud2}
    node = Node()
    RtabmapTopics(node, 'odom', None)
    assert node.kinds == {**clouds, 'odom_info': info, 'odom_info_lite': info,
                          'odom_rgbd_image': image}
    monkeypatch.setattr(rtabmap, 'OdomInfo', None)
    node = Node()
    topics = RtabmapTopics(node, 'odom', lambda: np.ones((2, 3)))
    assert node.kinds == clouds
    topics.show(registered())
    assert len(node.published['odom_local_map']) == 1


def test_each_image_and_its_camera_have_one_header(topics):
    rtabmap_topics, published = topics
    rtabmap_topics.show(registered())
    message, = published['odom_rgbd_image']
    assert message.rgb.header == message.rgb_camera_info.header == message.header
    assert message.depth.header == message.depth_camera_info.header
    stamps = [to_stamp(part.header.stamp) for part in (message.rgb, message.depth)]
    assert stamps == [STAMP, STAMP + 7]
    for info in (message.rgb_camera_info, message.depth_camera_info):
        assert info.header.frame_id == 'optical'
        np.testing.assert_array_equal(np.reshape(info.k, (3, 3)), CAMERA.matrix)
        np.testing.assert_array_equal(np.reshape(info.p, (3, 4)),
                                      np.column_stack([CAMERA.matrix, np.zeros(3)]))
        np.testing.assert_array_equal(np.reshape(info.r, (3, 3)), np.eye(3))
