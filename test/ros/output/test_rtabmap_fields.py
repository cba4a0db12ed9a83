# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The fields of the messages for RTAB-Map as who subscribes to them receives them."""

import dataclasses
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
from aick_ros.ros.output.rtabmap import RtabmapTopics
from aick_ros.ros.output.views import positions_of
from aick_ros.ros.robot_odometry import RobotUpdate

CAMERA = Camera(8, 6, 10.0, 11.0, 3.5, 2.5)
STAMP = 5_250_000_000
COVARIANCE = np.diag([1e-4, 2e-4, 3e-4, 4e-5, 5e-5, 6e-5])
SOURCE, TARGET = (np.random.default_rng(seed).uniform(0, 8, (4, 2)) for seed in (1, 2))
MATCHES = np.array([(3, 0), (1, 2)])


KINDS = {'odom_info': 'OdomInfo', 'odom_info_lite': 'OdomInfo', 'odom_rgbd_image': 'RGBDImage'}
CLOUDS = {'odom_last_frame': PointCloud2, 'odom_local_map': PointCloud2}


class Topics:
    """The topics of a node, and subscribers of some."""

    def __init__(self, graph, types):
        self._graph, self.node = graph, graph.node()
        self._kinds = {**CLOUDS, **{topic: types[name] for topic, name in KINDS.items()}}
        self._topics = RtabmapTopics(self.node, 'odom', lambda: np.ones((2, 3)))
        self.reset = self._topics.reset
        self._received = {}

    def show(self, update):
        self._topics.show(update, update.base)

    def listen(self, *topics):
        for topic in topics or self._kinds:
            self._received[topic] = self._graph.listen(self._kinds[topic], topic)

    def received(self, topic, count=1):
        """Wait for as many messages of a topic, and return all that came."""
        messages = self._received[topic]
        self._graph.wait_until(lambda: len(messages) >= count, f'{count} of {topic}')
        return messages


def installed(types, monkeypatch):
    """Let there be rtabmap_msgs, or not."""
    for module, names in ((rtabmap, ('OdomInfo', 'Point2f', 'RGBDImage')),
                          (rgbd_image, ('RGBDImage',))):
        for name in names:
            monkeypatch.setattr(module, name, types[name] if types else None)


@pytest.fixture
def quiet(graph, rtabmap_types, monkeypatch):
    """Return the topics of a node, to none of which anybody subscribes."""
    installed(rtabmap_types, monkeypatch)
    return Topics(graph, rtabmap_types)


@pytest.fixture
def topics(quiet):
    """Return the topics of a node, with a subscriber of each."""
    quiet.listen()
    return quiet


FRAME = RgbdFrame(STAMP, np.zeros((6, 8), np.uint8), np.ones((6, 8), np.float32), CAMERA,
                  STAMP + 7)


POSITIONS = np.random.default_rng(3).normal(0, 1, (4, 3))
T_ODOM_BASE = se3.exp([1.0, -2.0, 0.5, 0.3, -0.2, 1.1])


def registered(state=BaseState.TRACKED, forward=0.1, seconds=0.2, frame=FRAME, pixels=SOURCE):
    """Return a frame after a motion of the base straight on."""
    keypoints = SimpleNamespace(pixels=pixels, positions=POSITIONS)
    prepared = SimpleNamespace(frame=SimpleNamespace(camera=frame.camera), keypoints=keypoints)
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
    return RobotUpdate(frame, 'optical', update, base, T_ODOM_BASE,
                       se3.exp([0, 0, 1, 0, 0, 0]))


def test_times_are_seconds_and_counts_those_of_the_frame(topics):
    topics.show(registered())
    info, = topics.received('odom_info')
    assert (info.time_estimation, info.interval, info.stamp) == pytest.approx((0.035, 0.2, 5.25))
    assert (info.matches, info.inliers, info.features, info.local_map_size) == (2, 17, 4, 3)
    assert to_stamp(info.header.stamp) == STAMP and info.header.frame_id == 'odom'
    np.testing.assert_array_equal(np.reshape(info.covariance, (6, 6)), COVARIANCE)
    assert info.transform.translation.x == pytest.approx(0.1)


def test_corners_are_those_of_the_matches(topics):
    topics.show(registered())
    (info,), (lite,) = topics.received('odom_info'), topics.received('odom_info_lite')
    np.testing.assert_allclose([(p.x, p.y) for p in info.new_corners], SOURCE[[3, 1]])
    np.testing.assert_allclose([(p.x, p.y) for p in info.ref_corners], TARGET[[0, 2]])
    assert list(info.corner_inliers) == [0, 1]
    assert [len(each) for each in (lite.new_corners, lite.ref_corners, lite.corner_inliers)] == [
        0, 0, 0]
    assert (lite.local_map_size, lite.matches) == (3, 2)


def test_corners_lie_on_the_image_that_is_sent(topics):
    """On the spots of a distorted image, which is rectified: found in it by their brightness."""
    camera = Camera(120, 90, 90.0, 90.0, 59.5, 44.5, 'plumb_bob', (-0.3, 0.05, 0.01, -0.02))
    pixels = np.array([[20.0, 15.0], [100.0, 20.0], [25.0, 70.0], [90.0, 75.0]])
    v, u = np.mgrid[:90, :120]
    image = sum(200 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / 8) for x, y in pixels)
    frame = RgbdFrame(STAMP, image.astype(np.uint8), np.ones((90, 120), np.float32), camera)
    topics.show(registered(frame=frame, pixels=pixels))
    info, = topics.received('odom_info')
    sent = topics.received('odom_rgbd_image')[0].rgb
    sent = np.array(sent.data).reshape(sent.height, sent.width)
    for corner, pixel in zip(info.new_corners, pixels[MATCHES[:, 0]]):
        near = sent * (np.hypot(u - corner.x, v - corner.y) < 8)
        assert np.hypot(*(pixel - (corner.x, corner.y))) > 1
        assert corner.x == pytest.approx((near * u).sum() / near.sum(), abs=0.3)
        assert corner.y == pytest.approx((near * v).sum() / near.sum(), abs=0.3)


@pytest.mark.parametrize('state', [BaseState.LOST, BaseState.PREDICTED])
def test_without_a_measurement_the_camera_is_lost_and_its_motion_unknown(topics, state):
    topics.show(registered(state))
    info, = topics.received('odom_info')
    assert info.lost
    np.testing.assert_array_equal(np.reshape(info.covariance, (6, 6)), 9999.0 * np.eye(6))
    rotation = info.transform.rotation
    assert (rotation.x, rotation.y, rotation.z, rotation.w) == (0.0, 0.0, 0.0, 0.0)


def test_the_distance_is_the_sum_of_the_motions_since_the_reset(topics):
    for forward in (0.1, -0.1, 0.3):
        topics.show(registered(forward=forward))
    topics.show(registered(BaseState.LOST))
    assert [info.distance_travelled for info in topics.received('odom_info', 4)] == pytest.approx(
        [0.1, 0.2, 0.5, 0.5])
    topics.reset()
    topics.show(registered(forward=0.4))
    assert topics.received('odom_info', 5)[-1].distance_travelled == pytest.approx(0.4)


def test_images_that_repeat_are_no_way(topics):
    """Their motion is since the last tracked frame, and the next frame's has it again."""
    for state in (BaseState.TRACKED, BaseState.CONTINUED, BaseState.CONTINUED, BaseState.TRACKED):
        frame = registered()
        topics.show(dataclasses.replace(frame, base=dataclasses.replace(frame.base, state=state)))
    assert [info.distance_travelled for info in topics.received('odom_info', 4)] == pytest.approx(
        [0.1, 0.1, 0.1, 0.2])


def test_the_motion_is_that_of_the_base_and_what_is_not_known_is_null(topics):
    topics.show(registered(forward=0.1))
    info, = topics.received('odom_info')
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
    topics.show(registered(BaseState.LOST))
    info, = topics.received('odom_info')
    assert (info.interval, info.local_map_size, info.local_key_frames, info.matches,
            info.inliers) == (0.0, 0, 0, 0, 0)
    assert [len(each) for each in (info.new_corners, info.ref_corners, info.corner_inliers)] == [
        0, 0, 0]


def test_keypoints_and_local_map_are_sent_in_the_frame_of_the_odometry(topics):
    topics.show(registered())
    T_odom_camera = T_ODOM_BASE @ se3.exp([0, 0, 1, 0, 0, 0])
    for topic, points in (('odom_last_frame', POSITIONS), ('odom_local_map', np.ones((2, 3)))):
        cloud, = topics.received(topic)
        assert to_stamp(cloud.header.stamp) == STAMP and cloud.header.frame_id == 'odom'
        np.testing.assert_allclose(positions_of(cloud), se3.transform(T_odom_camera, points),
                                   atol=1e-5)


def test_of_a_lost_camera_there_is_an_image_and_no_cloud(topics):
    for state in (BaseState.TRACKED, BaseState.LOST, BaseState.TRACKED):
        topics.show(registered(state))
    assert len(topics.received('odom_rgbd_image', 3)) == 3  # it is lost, not blind
    assert [len(topics.received(topic, 2)) for topic in CLOUDS] == [2, 2]


def test_nothing_is_made_for_nobody(quiet, rtabmap_types, monkeypatch):
    with monkeypatch.context() as patched:
        for name in ('OdomInfo', 'rgbd_image', 'point_cloud'):
            patched.setattr(rtabmap, name, None)
        quiet.show(registered(forward=0.1))
    made = []
    monkeypatch.setattr(rtabmap, 'OdomInfo', lambda **fields: made.append(
        rtabmap_types['OdomInfo'](**fields)) or made[-1])
    quiet.listen('odom_info')
    quiet.show(registered(forward=0.2))
    info, = quiet.received('odom_info')
    assert info.distance_travelled == pytest.approx(0.3)  # what was travelled meanwhile counts
    assert len(made) == 1


def offered(node):
    """Return type and depth of the queue of the topics that a node publishes for RTAB-Map."""
    return {each.topic_name[1:]: (each.msg_type, each.qos_profile.depth)
            for each in node.publishers if each.topic_name.startswith('/odom_')}


def test_each_topic_has_its_type(topics, rtabmap_types):
    expected = {**CLOUDS, **{topic: rtabmap_types[name] for topic, name in KINDS.items()}}
    assert offered(topics.node) == {topic: (kind, 10) for topic, kind in expected.items()}


def test_without_the_messages_there_are_clouds_alone(graph, rtabmap_types, monkeypatch):
    installed(None, monkeypatch)
    topics = Topics(graph, rtabmap_types)
    assert offered(topics.node) == {topic: (kind, 10) for topic, kind in CLOUDS.items()}
    topics.listen(*CLOUDS)
    topics.show(registered())
    assert len(topics.received('odom_local_map')) == 1


def test_each_image_and_its_camera_have_one_header(topics):
    topics.show(registered())
    message, = topics.received('odom_rgbd_image')
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
