# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bags written by plain rosbags: against what was put in, and each way in which one can be bad."""

import dataclasses
import os
import re
import shutil
import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from aick_ros.borders import bag_limits
from aick_ros.borders.limits import MAX_METADATA_BYTES
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources import SourceOptions, bag_file, open_source, raise_damage
from aick_ros.sources.bag import BagSource

STORES = {1: get_typestore(Stores.ROS1_NOETIC), 2: get_typestore(Stores.ROS2_JAZZY)}
COLOUR, DEPTH, INFO, TRUTH = '/rgb/image_raw', '/depth/image_raw', '/rgb/camera_info', (
    '/ground_truth')
NS = 1_000_000_000
NAMES = {1: 'one.bag', 2: 'bag'}


class Messages:
    """Makes messages of ROS 1 or 2."""

    def __init__(self, version=2):
        self.version, self.store = version, STORES[version]

    def make(self, type_, *fields):
        return self.store.types[type_](*fields)

    def header(self, stamp, frame='camera'):
        time = self.make('builtin_interfaces/msg/Time', stamp // NS, stamp % NS)
        sequence = (0,) if self.version == 1 else ()
        return self.make('std_msgs/msg/Header', *sequence, time, frame)

    def image(self, stamp, image, encoding, padding=0, frame='camera'):
        flat = np.ascontiguousarray(image).view(np.uint8).reshape(image.shape[0], -1)
        flat = np.pad(flat, ((0, 0), (0, padding)))
        return self.make('sensor_msgs/msg/Image', self.header(stamp, frame), *image.shape[:2],
                         encoding, 0, flat.shape[1], flat.ravel())

    def compressed(self, stamp, format_, data):
        return self.make('sensor_msgs/msg/CompressedImage', self.header(stamp), format_,
                         np.frombuffer(data, np.uint8))

    def info(self, camera, k=None):
        region = self.make('sensor_msgs/msg/RegionOfInterest', 0, 0, 0, 0, False)
        return self.make(
            'sensor_msgs/msg/CameraInfo', self.header(1), camera.height, camera.width,
            camera.distortion_model, np.array(camera.distortion, np.float64),
            camera.matrix.ravel() if k is None else k, np.eye(3).ravel(), np.zeros(12), 0, 0,
            region)

    def transform(self, stamp, T, parent='camera', child='camera'):
        transform = self.make(
            'geometry_msgs/msg/Transform',
            self.make('geometry_msgs/msg/Vector3', *map(float, T[:3, 3])),
            self.make('geometry_msgs/msg/Quaternion', *map(float, se3.to_quaternion(T[:3, :3]))))
        return self.make('geometry_msgs/msg/TransformStamped', self.header(stamp, parent), child,
                         transform)

    def pose(self, type_, stamp, T):
        if type_ == 'geometry_msgs/msg/TransformStamped':
            return self.transform(stamp, T)
        x, y, z = map(float, T[:3, 3])
        quaternion = self.make('geometry_msgs/msg/Quaternion',
                               *map(float, se3.to_quaternion(T[:3, :3])))
        pose = self.make('geometry_msgs/msg/Pose',
                         self.make('geometry_msgs/msg/Point', x, y, z), quaternion)
        if type_ == 'geometry_msgs/msg/PoseStamped':
            return self.make(type_, self.header(stamp), pose)
        pose = self.make('geometry_msgs/msg/PoseWithCovariance', pose, np.zeros(36))
        if type_ == 'geometry_msgs/msg/PoseWithCovarianceStamped':
            return self.make(type_, self.header(stamp), pose)
        zero = self.make('geometry_msgs/msg/Vector3', 0.0, 0.0, 0.0)
        twist = self.make('geometry_msgs/msg/TwistWithCovariance',
                          self.make('geometry_msgs/msg/Twist', zero, zero), np.zeros(36))
        return self.make(type_, self.header(stamp), 'camera', pose, twist)

    def recording(self, recording):
        """Return the topics and messages of a recording, colour raw and depth in metres."""
        yield INFO, self.info(recording.recorded[0].camera)
        for frame in recording.recorded:
            yield COLOUR, self.image(frame.stamp, frame.colour, 'rgb8')
            yield DEPTH, self.image(frame.depth_stamp, frame.depth, '32FC1')


def write(path, messages, version=2, storage=StoragePlugin.MCAP, log_time=None):
    """
    Write topics and messages in the given order.

    :param log_time: function of a message [ns]; None: a millisecond after the one before.
    """
    store = STORES[version]
    writer = Writer1(path) if version == 1 else Writer2(path, version=9, storage_plugin=storage)
    serialize = store.serialize_ros1 if version == 1 else store.serialize_cdr
    connections = {}
    with writer:
        for index, (topic, message) in enumerate(messages):
            if (key := (topic, message.__msgtype__)) not in connections:
                connections[key] = writer.add_connection(*key, typestore=store)
            content = serialize(message, message.__msgtype__)
            logged = log_time(message) if log_time else 1000 * NS + index * 1_000_000
            writer.write(connections[key], logged, content)
    return path


def stamp_of(message):
    return message.header.stamp.sec * NS + message.header.stamp.nanosec


def read(source):
    damage = []
    return list(source.frames(damage.append)), [str(error) for error in damage]


@pytest.fixture
def bag(tmp_path, recording):
    return write(tmp_path / 'bag', Messages().recording(recording))


@pytest.mark.parametrize('version, storage, name', [
    (2, StoragePlugin.MCAP, 'bag'), (2, StoragePlugin.SQLITE3, 'bag'),
    (2, StoragePlugin.MCAP, 'run.bag'), (1, None, 'one.bag')])
def test_frames_come_back(tmp_path, recording, assert_same_frames, version, storage, name):
    path = write(tmp_path / name, Messages(version).recording(recording), version, storage)
    source = BagSource(path)
    assert source.name == name
    assert source.ground_truth is None
    assert len(source) == 6
    for _ in range(2):
        assert_same_frames(list(source.frames(raise_damage)), recording.recorded)


def test_a_topic_of_several_types_is_said_to_be_one(tmp_path, recording):
    messages = Messages()
    path = write(tmp_path / 'bag', [*messages.recording(recording),
                                    (COLOUR, messages.info(recording.recorded[0].camera))])
    with pytest.raises(InputError, match=re.escape(f'{COLOUR} (messages of several types)')):
        BagSource(path)


@pytest.mark.parametrize('topic', [COLOUR, DEPTH])
def test_the_length_is_that_of_the_topic_with_fewer_images(tmp_path, recording, topic):
    messages = list(Messages().recording(recording))
    last = max(i for i, (name, _) in enumerate(messages) if name == topic)
    del messages[last]
    source = BagSource(write(tmp_path / 'bag', messages))
    assert len(source) == len(list(source.frames(raise_damage))) == 5


@pytest.mark.parametrize('storage, suffix', [
    (StoragePlugin.MCAP, '.mcap'), (StoragePlugin.SQLITE3, '.db3')])
def test_a_storage_file_alone_will_do(tmp_path, recording, assert_same_frames, storage, suffix):
    bag = write(tmp_path / 'bag', Messages().recording(recording), storage=storage)
    (bag / 'metadata.yaml').unlink()
    for path in (bag / f'bag{suffix}', bag):
        assert_same_frames(list(BagSource(path).frames(raise_damage)), recording.recorded)


def test_several_storage_files_without_metadata_are_rejected(bag):
    (bag / 'metadata.yaml').unlink()
    shutil.copy(bag / 'bag.mcap', bag / 'bag_1.mcap')
    with pytest.raises(InputError, match='has 2 storage files and no metadata.yaml.*reindex'):
        BagSource(bag)


def test_a_sqlite_bag_without_definitions_is_read(tmp_path, recording, assert_same_frames):
    import sqlite3
    bag = write(tmp_path / 'bag', Messages().recording(recording), storage=StoragePlugin.SQLITE3)
    with sqlite3.connect(bag / 'bag.db3') as database:
        database.execute('DELETE FROM message_definitions')
    database.close()
    assert_same_frames(list(BagSource(bag).frames(raise_damage)), recording.recorded)


def test_images_that_arrive_late_find_their_partners(tmp_path, recording, assert_same_frames):
    messages = Messages()
    info, *images = messages.recording(recording)
    order = [info, *images[0::2], *images[1::2]]  # first all colour, then all depth
    source = BagSource(write(tmp_path / 'bag', order))
    assert_same_frames(list(source.frames(raise_damage)), recording.recorded)


def test_a_message_of_another_topic_than_its_index_says_is_named(tmp_path, recording):
    """In a ROS 1 bag both the index and the message itself name the connection."""
    messages = Messages(1)
    pose = messages.pose('geometry_msgs/msg/PoseStamped', 1, np.eye(4))
    path = write(tmp_path / 'one.bag', [*messages.recording(recording), ('/path', pose)], 1)
    content, before = path.read_bytes(), rb'\t\x00\x00\x00conn='
    colour, other = (re.search(rb'op=\x07' + before + rb'(....)....topic=' + topic, content,
                               re.DOTALL)[1] for topic in (COLOUR.encode(), b'/path'))
    path.write_bytes(re.sub(rb'(op=\x02' + before + b')' + re.escape(colour), rb'\1' + other,
                            content, count=1))
    with pytest.raises(InputError, match=r'one.bag cannot be read as a bag \(its index has a '
                                         r'message of /path as one of another topic\): copy or'):
        read(BagSource(path))


@pytest.mark.parametrize('version', [1, 2])
def test_compressed_images_come_back(tmp_path, recording, assert_same_frames, version):
    messages = Messages(version)

    def compressed():
        yield INFO, messages.info(recording.recorded[0].camera)
        for frame in recording.recorded:
            colour = cv2.imencode('.png', frame.colour[:, :, ::-1])[1].tobytes()
            yield COLOUR + '/compressed', messages.compressed(
                frame.stamp, 'rgb8; png compressed bgr8', colour)
            # 16 bits hold A / depth - B exactly where it was made of them
            units = np.arange(1, 24 * 32 + 1, dtype=np.uint16).reshape(24, 32)
            depth = struct.pack('<iff', 0, 900.0, -3.0) + cv2.imencode('.png', units)[1].tobytes()
            yield DEPTH + '/compressedDepth', messages.compressed(
                frame.depth_stamp, '32FC1; compressedDepth png', depth)

    path = write(tmp_path / NAMES[version], compressed(), version)
    expected = (900.0 / (np.arange(1, 24 * 32 + 1) + 3.0)).reshape(24, 32).astype(np.float32)
    frames = list(BagSource(path).frames(raise_damage))
    assert len(frames) == 6
    for frame, original in zip(frames, recording.recorded):
        assert np.array_equal(frame.colour, original.colour)
        assert np.allclose(frame.depth, expected, rtol=1e-6)


def test_padded_rows_and_millimetres_come_back(tmp_path, recording):
    messages = Messages()
    millimetres = np.random.default_rng(8).integers(1, 9000, (24, 32)).astype('<u2')

    def images():
        yield INFO, messages.info(recording.recorded[0].camera)
        frame = recording.recorded[0]
        yield COLOUR, messages.image(5 * NS, frame.colour, 'bgr8', padding=7)
        yield DEPTH, messages.image(5 * NS, millimetres, '16UC1', padding=4)

    frame, = BagSource(write(tmp_path / 'bag', images())).frames(raise_damage)
    assert np.array_equal(frame.colour, recording.recorded[0].colour[:, :, ::-1])
    assert np.array_equal(frame.depth, (millimetres / 1000).astype(np.float32))


@pytest.mark.parametrize('version, type_', [
    (2, 'geometry_msgs/msg/PoseStamped'), (2, 'geometry_msgs/msg/PoseWithCovarianceStamped'),
    (2, 'geometry_msgs/msg/TransformStamped'), (2, 'nav_msgs/msg/Odometry'),
    (1, 'geometry_msgs/msg/PoseStamped'), (1, 'nav_msgs/msg/Odometry')])
def test_ground_truth_is_read(tmp_path, recording, version, type_):
    messages = Messages(version)
    truth = recording.ground_truth
    rows = [(TRUTH, messages.pose(type_, int(stamp), pose))
            for stamp, pose in zip(truth.stamps, truth.poses)]
    rows += [rows[3], (TRUTH, messages.pose(type_, 7 * NS, np.eye(4)))]
    lost = messages.pose(type_, 8 * NS, np.eye(4))
    quaternion = (lost.transform.rotation if hasattr(lost, 'transform') else
                  getattr(lost.pose, 'pose', lost.pose).orientation)
    quaternion.w = 0.0
    rows.append((TRUTH, lost))
    path = write(tmp_path / NAMES[version], [*messages.recording(recording), *rows], version)
    read_back = BagSource(path).ground_truth
    assert read_back.stamps.tolist() == [7 * NS, *truth.stamps]
    assert np.allclose(read_back.poses[1:], truth.poses, atol=1e-12)


def test_a_given_ground_truth_topic_is_taken(tmp_path, recording):
    messages = Messages()
    rows = [('/mocap', messages.pose('geometry_msgs/msg/PoseStamped', NS, np.eye(4)))]
    path = write(tmp_path / 'bag', [*messages.recording(recording), *rows])
    assert BagSource(path).ground_truth is None
    assert len(BagSource(path, SourceOptions(ground_truth_topic='/mocap')).ground_truth) == 1


def test_given_topics_and_camera_are_taken(tmp_path, recording, assert_same_frames):
    messages = Messages()
    names = {COLOUR: '/a', DEPTH: '/b'}
    rows = [(names[topic], message) for topic, message in messages.recording(recording)
            if topic in names]
    path = write(tmp_path / 'bag', rows)
    camera = tmp_path / 'camera.json'
    camera.write_text('{"width": 32, "height": 24, "k": [9, 0, 16, 0, 9, 12, 0, 0, 1]}')
    source = BagSource(path, SourceOptions(camera, colour_topic='/a', depth_topic='/b'))
    frames = list(source.frames(raise_damage))
    assert len(frames) == 6 and frames[0].camera.fx == 9


@pytest.mark.parametrize('depth_topic', [DEPTH, None])
def test_one_topic_for_both_images_is_rejected(bag, depth_topic):
    """Given for colour alone, it is that of depth by its name."""
    with pytest.raises(InputError, match='bag: the same topic is given for colour and depth, '
                       f'{DEPTH}: give both, with --colour-topic and --depth-topic$'):
        BagSource(bag, SourceOptions(colour_topic=DEPTH, depth_topic=depth_topic))


def halved(frame):
    """Return a frame of half the size with its camera."""
    half = Camera(16, 12, 12.75, 12.5, 7.75, 5.5)
    return dataclasses.replace(frame, colour=frame.colour[::2, ::2], depth=frame.depth[::2, ::2],
                               camera=half)


def of_two_sizes(messages, frames):
    """Yield the topics and messages of frames, each with its camera_info and one of zeros."""
    for frame in frames:
        yield INFO, messages.info(frame.camera)
        yield INFO, messages.info(frame.camera, np.zeros(9))
        yield COLOUR, messages.image(frame.stamp, frame.colour, 'rgb8')
        yield DEPTH, messages.image(frame.depth_stamp, frame.depth, '32FC1')


@pytest.mark.parametrize('version', [1, 2])
def test_images_have_the_camera_of_the_latest_camera_info(
        tmp_path, recording, assert_same_frames, version):
    """One that describes no camera changes nothing; each reading begins with the first one."""
    frames = [*recording.recorded[:3], *map(halved, recording.recorded[3:])]
    frames = [dataclasses.replace(frame, depth_stamp=frame.stamp) for frame in frames]
    source = BagSource(write(tmp_path / NAMES[version], of_two_sizes(Messages(version), frames),
                             version))
    for _ in range(2):
        assert_same_frames(list(source.frames(raise_damage)), frames)


def test_two_drivers_on_one_camera_info_are_told_once_and_the_first_counts(tmp_path, recording):
    frames = recording.recorded
    other = dataclasses.replace(frames[0].camera, fx=99.0)
    messages = Messages()

    def rows():
        for frame in frames:
            yield INFO, messages.info(frame.camera)
            yield COLOUR, messages.image(frame.stamp, frame.colour, 'rgb8')
            yield INFO, messages.info(other)
            yield DEPTH, messages.image(frame.depth_stamp, frame.depth, '32FC1')
    path = write(tmp_path / 'bag', rows())
    source = BagSource(path)
    assert source.remarks == []
    found = list(source.frames(raise_damage))
    assert {frame.camera.fx for frame in found[1:]} == {frames[0].camera.fx}
    remark, = source.remarks
    assert remark.startswith(f'{path}: {INFO} alternates between two calibrations')
    assert '--camera FILE' in remark


def test_a_camera_that_is_given_never_changes(tmp_path, recording):
    camera = tmp_path / 'camera.json'
    camera.write_text('{"width": 32, "height": 24, "k": [9, 0, 16, 0, 9, 12, 0, 0, 1]}')
    path = write(tmp_path / 'bag', of_two_sizes(Messages(), recording.recorded))
    frames = BagSource(path, SourceOptions(camera)).frames(raise_damage)
    assert [frame.camera.fx for frame in frames] == 6 * [9]


def test_no_camera_info_says_how_to_give_one(tmp_path, recording):
    rows = [row for row in Messages().recording(recording) if row[0] != INFO]
    with pytest.raises(InputError, match='no camera_info topic.*it has /depth.*--camera FILE'):
        BagSource(write(tmp_path / 'bag', rows))


def test_a_camera_info_of_zeros_is_rejected(tmp_path, recording):
    messages = Messages()
    rows = [(INFO, messages.info(recording.recorded[0].camera, np.zeros(9)))]
    rows += list(messages.recording(recording))[1:]
    with pytest.raises(InputError, match='/rgb/camera_info: camera_info is not calibrated'):
        BagSource(write(tmp_path / 'bag', rows))


def test_a_bag_without_images_is_rejected(tmp_path, camera):
    path = write(tmp_path / 'bag', [(INFO, Messages().info(camera))])
    with pytest.raises(InputError, match='no colour topic.*it has /rgb/camera_info'):
        BagSource(path)


def test_an_empty_bag_is_rejected(tmp_path):
    with pytest.raises(InputError, match='no colour topic.*it has no messages'):
        BagSource(write(tmp_path / 'bag', []))


def test_damaged_images_are_reported_and_the_next_ones_read(
        tmp_path, recording, assert_same_frames):
    rows = list(Messages().recording(recording))
    for row, changes in ((1, {'encoding': 'rgb9'}), (4, {'step': 3}), (5, {'height': 0}),
                         (7, {'encoding': '16UC1'}), (10, {'encoding': 'bgr8'})):
        for name, value in changes.items():
            setattr(rows[row][1], name, value)
    frames, damage = read(BagSource(write(tmp_path / 'bag', rows)))
    assert_same_frames(frames, recording.recorded[5:])
    for text, where, reason in zip(damage, (COLOUR, DEPTH, COLOUR, COLOUR, DEPTH), (
            "unknown encoding 'rgb9'", 'step 3', '32 x 0 pixels', 'which is depth',
            'which is colour')):
        assert f'bag, {where} at 1305031102.' in text and reason in text
    assert len(damage) == 5


def test_a_message_that_is_cut_is_reported(tmp_path, recording, assert_same_frames):
    store = STORES[2]
    path = tmp_path / 'bag'
    connections = {}
    with Writer2(path, version=9) as writer:
        for index, (topic, message) in enumerate(Messages().recording(recording)):
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=store)
            content = bytes(store.serialize_cdr(message, message.__msgtype__))
            writer.write(connections[topic], index * NS, content[:90] if index == 3 else content)
    frames, damage = read(BagSource(path))
    assert_same_frames(frames, recording.recorded[:1] + recording.recorded[2:])
    assert len(damage) == 1
    assert '/rgb/image_raw recorded at 3.000000000: the message is damaged' in damage[0]


def test_depth_of_another_size_is_reported(tmp_path, recording):
    messages = Messages()
    rows = list(messages.recording(recording))
    small = np.ones((15, 20), np.float32)
    rows[2] = (DEPTH, messages.image(recording.recorded[0].depth_stamp, small, '32FC1'))
    frames, damage = read(BagSource(write(tmp_path / 'bag', rows)))
    assert len(frames) == 5
    assert 'colour is 32 x 24 and depth 20 x 15 pixels' in damage[0]


def test_depth_of_half_the_size_is_enlarged(tmp_path, recording):
    messages = Messages()
    rows = list(messages.recording(recording))
    small = np.full((12, 16), 1.5, np.float32)
    rows[2] = (DEPTH, messages.image(recording.recorded[0].depth_stamp, small, '32FC1'))
    frames, _ = read(BagSource(write(tmp_path / 'bag', rows)))
    np.testing.assert_allclose(frames[0].depth, np.full((24, 32), 1.5), rtol=1e-6)


@pytest.mark.parametrize('version', [1, 2])
def test_rectified_images_take_p(tmp_path, recording, version):
    """As the topic's name says that they are."""
    messages = Messages(version)
    rows = list(messages.recording(recording))
    info = rows[0][1]
    (info.P if version == 1 else info.p)[[0, 2, 5, 6]] = 20.0, 15.0, 21.0, 11.0
    renamed = [('/rgb/image_rect_color' if topic == COLOUR else topic, message)
               for topic, message in rows]
    path = write(tmp_path / NAMES[version], renamed, version)
    camera = next(BagSource(path).frames(raise_damage)).camera
    assert (camera.fx, camera.cx, camera.fy, camera.cy) == (20, 15, 21, 11)
    assert camera.distortion == ()


def test_stamps_that_repeat_or_go_back_are_left_out_and_reported(
        tmp_path, recording, assert_same_frames):
    rows = list(Messages().recording(recording))
    rows += rows[1:5]  # the bag's images once more, as a looped player records them
    frames, damage = read(BagSource(write(tmp_path / 'bag', rows)))
    assert_same_frames(frames, recording.recorded)
    assert len(damage) == 4
    assert 'the stamp repeats or goes back from 1305031102.290123454' in damage[0]


def stream(recording, seconds):
    """Yield camera_info and pairs of equal stamps [s after the start of the recording]."""
    messages, frame = Messages(), recording.recorded[0]
    yield INFO, messages.info(frame.camera)
    for second in seconds:
        stamp = frame.stamp + round(second * NS)
        yield COLOUR, messages.image(stamp, frame.colour, 'rgb8')
        yield DEPTH, messages.image(stamp, frame.depth, '32FC1')


@pytest.mark.parametrize('seconds, stray', [
    ((0.0, 0.1, 1e6, 0.3, 0.4), {2}),
    ((1e6, 0.1, 0.2, 0.3), {0}),
    ((0.0, 0.1, 1e6, 0.3, 1e6 + 50, 0.5, 0.6), {2, 4}),
    ((0.0, 1e6, 1e6 + 0.1, 0.3, 0.4), {1, 2}),
    ((0.0, 0.1, 5.0, 0.3, 0.4), {2}),
    ((0.0, 0.1, 0.2, 1e6), {3})])
def test_only_images_with_a_stray_stamp_are_dropped(tmp_path, recording, seconds, stray):
    path = write(tmp_path / 'bag', stream(recording, seconds))
    frames, damage = read(BagSource(path))
    start = recording.recorded[0].stamp
    assert [frame.stamp for frame in frames] == [
        start + round(second * NS) for i, second in enumerate(seconds) if i not in stray]
    assert len(damage) == 2 * len(stray)
    assert all('is far ahead of' in text for text in damage)


def test_a_stray_stamp_of_one_topic_costs_one_pair(tmp_path, recording):
    rows = list(stream(recording, (0.0, 0.1, 0.2, 0.3)))
    rows[5][1].header.stamp.sec += 1_000_000
    frames, damage = read(BagSource(write(tmp_path / 'bag', rows)))
    assert len(frames) == 3
    text, = damage
    assert f'{COLOUR} at 13060311' in text and 'is far ahead of' in text


def test_after_a_pause_every_image_is_read(tmp_path, recording):
    """The log times of a recorded pause pass as the stamps do."""
    seconds = (0.0, 0.1, 75.0, 75.1, 4000.0, 4000.1)
    path = write(tmp_path / 'bag', stream(recording, seconds), log_time=stamp_of)
    frames = list(BagSource(path).frames(raise_damage))
    start = recording.recorded[0].stamp
    assert [frame.stamp for frame in frames] == [start + round(s * NS) for s in seconds]


def test_a_recording_that_starts_again_is_read_once(tmp_path, recording):
    """The stamps of the frames increase; the second round is reported."""
    once = (0.0, 5.0, 10.0, 15.0, 20.0)
    path = write(tmp_path / 'bag', stream(recording, once + once))
    frames, damage = read(BagSource(path))
    assert [frame.stamp - frames[0].stamp for frame in frames] == [round(s * NS) for s in once]
    assert len(damage) == 2 * len(once)
    assert all('repeats or goes back from' in text for text in damage)


def test_images_without_stamps_are_rejected(tmp_path, recording):
    rows = list(Messages().recording(recording))
    for _, message in rows:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    source = BagSource(write(tmp_path / 'bag', rows))
    damage = []
    with pytest.raises(InputError, match='no image on /rgb/image_raw is within 0.02 s of one on'):
        list(source.frames(damage.append))
    assert len(damage) == 12


def test_the_interval_limits_the_pairs(bag, recording):
    frames = list(BagSource(bag, SourceOptions(max_interval=0.004)).frames(raise_damage))
    expected = [frame.stamp for frame in recording.recorded
                if abs(frame.stamp - frame.depth_stamp) <= 4_000_000]
    assert [frame.stamp for frame in frames] == expected


@pytest.mark.parametrize('kind, share', [
    (kind, share) for kind in ('mcap', 'db3', 'bag') for share in (0.0, 0.01, 0.3, 0.7, 0.9)])
def test_a_truncated_file_is_rejected(tmp_path, recording, kind, share):
    version = 1 if kind == 'bag' else 2
    storage = StoragePlugin.SQLITE3 if kind == 'db3' else StoragePlugin.MCAP
    path = write(tmp_path / NAMES[version], Messages(version).recording(recording), version,
                 storage)
    file = path if version == 1 else path / f'bag.{kind}'
    file.write_bytes(file.read_bytes()[:int(share * file.stat().st_size)])
    with pytest.raises(InputError, match=(
            r'cannot be read as a bag \(.*\): copy or record it again, '
            r'or repair it \(`ros2 bag reindex` for a ROS 2 bag, `mcap '
            r'recover` for an mcap file, `rosbag reindex` for a ROS 1 '
            r'bag\)$')):
        list(BagSource(path).frames(raise_damage))


@pytest.mark.parametrize('text', ['', 'a: [', 'rosbag2_bagfile_information: {version: 99}',
                                  'rosbag2_bagfile_information: {version: 5}', '3'])
def test_damaged_metadata_is_rejected(bag, text):
    (bag / 'metadata.yaml').write_text(text)
    with pytest.raises(InputError, match='bag cannot be read as a bag .*reindex'):
        BagSource(bag)


def test_a_missing_storage_file_is_rejected(bag):
    (bag / 'bag.mcap').unlink()
    with pytest.raises(InputError, match='cannot be read as a bag .*files are missing'):
        BagSource(bag)


def test_every_damaged_byte_gives_frames_or_one_sentence(tmp_path, recording):
    """Anything rosbags raises on a damaged index must come out as an InputError."""
    path = write(tmp_path / 'bag', Messages().recording(recording)) / 'bag.mcap'
    content = path.read_bytes()
    rng = np.random.default_rng(9)
    index = content.rindex(b'rosbag2') - 4000
    for place in [*rng.integers(0, index, 20), *rng.integers(index, len(content), 60)]:
        damaged = bytearray(content)
        damaged[place] ^= 0xff
        path.write_bytes(damaged)
        try:
            frames = list(BagSource(path).frames(lambda error: None))
        except InputError as error:
            assert str(error)
        else:
            assert len(frames) <= 6


def test_only_few_images_wait_for_a_partner(tmp_path, recording, monkeypatch):
    """Memory is bounded where one topic stops: the waiting images are dropped."""
    messages = Messages()
    first = recording.recorded[0]

    def rows():
        yield INFO, messages.info(first.camera)
        yield COLOUR, messages.image(NS, first.colour, 'rgb8')
        yield DEPTH, messages.image(NS, first.depth, '32FC1')
        for index in range(1, 300):
            yield COLOUR, messages.image(NS + index * NS // 30, first.colour, 'rgb8')

    waiting = []
    decode = SimpleNamespace(alive=0)

    class Watched:
        def __init__(self, message):
            self.header = message.header
            decode.alive += 1
            waiting.append(decode.alive)

        def __del__(self):
            decode.alive -= 1

    source = BagSource(write(tmp_path / 'bag', rows()))
    original = source._bag.messages
    monkeypatch.setattr(source._bag, 'messages', lambda *arguments: (
        row if row.topic == INFO else row._replace(content=Watched(row.content))
        for row in original(*arguments)))
    monkeypatch.setattr(source._decoder, 'decode', lambda pair, camera: first)
    assert len(list(source.frames(raise_damage))) == 1
    assert len(waiting) == 301
    assert max(waiting) <= 70


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_messages_that_are_too_large_are_rejected_before_they_are_read(
        tmp_path, recording, monkeypatch, storage):
    folder = write(tmp_path / 'bag', Messages().recording(recording), storage=storage)
    largest = 32 * 24 * 4
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', largest // 2)
    monkeypatch.setattr(bag_file, 'AnyReader', None)  # nothing is read
    with pytest.raises(InputError, match=r'bag.* has a message or chunk of \d+ bytes: at most'):
        BagSource(folder)


def test_pipes_are_rejected_as_bags_and_in_bags(bag):
    (storage,) = bag.glob('*.mcap')
    storage.unlink()
    os.mkfifo(storage)
    for path in (bag, storage):
        with pytest.raises(InputError, match='mcap: it is .*regular file'):
            open_source(path)
    (bag / 'metadata.yaml').unlink()
    os.mkfifo(bag / 'metadata.yaml')
    storage.unlink()
    with pytest.raises(InputError, match='cannot read the metadata .*: it is not a regular file'):
        open_source(bag)


def test_large_metadata_is_rejected(bag):
    with open(bag / 'metadata.yaml', 'a') as file:
        file.write('#' * MAX_METADATA_BYTES)
    with pytest.raises(InputError, match='cannot read the metadata .* larger than 1048576 bytes'):
        open_source(bag)


@pytest.mark.parametrize('count', ['many', '-5', '.nan', '1' + 30 * '0', '3.5'])
def test_metadata_with_impossible_counts_is_rejected(bag, count):
    metadata = bag / 'metadata.yaml'
    text = re.sub(r'message_count: \d+', f'message_count: {count}', metadata.read_text())
    metadata.write_text(text)
    with pytest.raises(InputError, match=(
            'bag: its metadata counts .* messages on /[a-z_/]+; run `ros2 bag reindex` on it$|'
            'cannot be read as a bag')):
        BagSource(bag)


def defined(path, recording, standard, other):
    """Write a bag that defines its messages otherwise, and return its file."""
    folder = write(path, Messages().recording(recording))
    file, = folder.glob('*.mcap')  # the metadata of a folder have the hash of the definitions
    content = file.read_bytes()
    assert standard in content
    file.write_bytes(content.replace(standard, other.ljust(len(standard))))
    return file


def test_a_calibration_that_its_bag_defines_otherwise_is_rejected(tmp_path, recording):
    file = defined(tmp_path / 'bag', recording, b'float64[12] p', b'float64[12] q')
    with pytest.raises(InputError, match=f'{INFO}: the messages are not of the type that they are '
                       r'declared as \(sensor_msgs/msg/CameraInfo has no p\)'):
        BagSource(file)


@pytest.mark.parametrize('standard, other', [
    (b'string encoding', b'string encodin'), (b'uint32 step', b'uint32 ste'),
    (b'uint8[] data', b'uint8[] dat'), (b'uint32 step', b'string step')])
def test_images_that_their_bag_defines_otherwise_are_rejected(tmp_path, recording, standard,
                                                              other):
    file = defined(tmp_path / 'bag', recording, standard, other)
    with pytest.raises(InputError, match=f'({COLOUR}|{DEPTH}): the messages are not of the type'):
        list(BagSource(file).frames(raise_damage))


def test_a_defect_of_ours_is_not_taken_for_one_of_the_bag(tmp_path, recording, monkeypatch):
    source = BagSource(write(tmp_path / 'bag', Messages().recording(recording)))
    monkeypatch.setattr(source._decoder, 'decode', lambda pair, camera: pair.no_such_field)
    with pytest.raises(AttributeError):
        list(source.frames(raise_damage))


def test_a_pair_that_waits_for_a_later_image_comes_at_the_end(tmp_path, recording):
    """Its stamps are so far apart that a later image could be nearer, but there is none."""
    messages, frame = Messages(), recording.recorded[0]
    rows = [(INFO, messages.info(frame.camera))]
    for index in range(3):
        stamp = frame.stamp + index * 30_000_000
        rows += [(COLOUR, messages.image(stamp, frame.colour, 'rgb8')),
                 (DEPTH, messages.image(stamp + 14_000_000, frame.depth, '32FC1'))]
    frames = list(BagSource(write(tmp_path / 'bag', rows)).frames(raise_damage))
    assert [(each.stamp - frame.stamp, each.depth_stamp - each.stamp) for each in frames] == [
        (index * 30_000_000, 14_000_000) for index in range(3)]


def test_an_image_alone_is_reported_by_the_interval_and_both_topics(tmp_path, recording):
    messages, frame = Messages(), recording.recorded[0]
    rows = [(INFO, messages.info(frame.camera)),
            (COLOUR, messages.image(frame.stamp, frame.colour, 'rgb8')),
            (DEPTH, messages.image(frame.stamp + 30_000_000, frame.depth, '32FC1'))]
    path = write(tmp_path / 'bag', rows)
    with pytest.raises(InputError) as raised:
        list(BagSource(path, SourceOptions(max_interval=0.0125)).frames(raise_damage))
    assert str(raised.value) == (
        f'{path}: no image on {COLOUR} is within 0.0125 s of one on {DEPTH}: check the stamps of '
        'the two drivers')
    assert len(list(BagSource(path, SourceOptions(max_interval=0.03)).frames(raise_damage))) == 1


@pytest.mark.parametrize('names, given, expected', [
    ({}, {}, (COLOUR, DEPTH, INFO)),
    ({INFO: '/x/info'}, {'info_topic': '/x/info'}, (COLOUR, DEPTH, '/x/info')),
    ({}, {'info_topic': '/other/camera_info'}, (COLOUR, DEPTH, '/other/camera_info'))])
def test_raw_topics_are_those_that_are_read(tmp_path, recording, names, given, expected):
    messages = Messages()
    rows = [(names.get(topic, topic), message) for topic, message in messages.recording(recording)]
    rows.append(('/other/camera_info', messages.info(recording.recorded[0].camera)))
    assert BagSource(write(tmp_path / 'bag', rows), SourceOptions(**given)).raw_topics == expected


def test_compressed_images_and_a_missing_calibration_have_no_raw_topics(tmp_path, recording):
    messages = Messages()
    rows = list(messages.recording(recording))
    camera = tmp_path / 'camera.json'
    camera.write_text('{"width": 32, "height": 24, "k": [9, 0, 16, 0, 9, 12, 0, 0, 1]}')
    options = SourceOptions(camera=camera)
    bare = write(tmp_path / 'bare', [row for row in rows if row[0] != INFO])
    assert BagSource(bare, options).raw_topics is None
    for topic in (COLOUR, DEPTH):
        packed = [(f'{name}/compressed', messages.compressed(stamp_of(message), 'png', b'x'))
                  if name == topic else (name, message) for name, message in rows]
        source = BagSource(write(tmp_path / topic.split('/')[1], packed), options)
        assert source.raw_topics is None


def test_ground_truth_without_a_pose_is_none(tmp_path, recording):
    messages = Messages()
    lost = messages.pose('geometry_msgs/msg/PoseStamped', NS, np.eye(4))
    lost.pose.orientation.w = 0.0
    path = write(tmp_path / 'bag', [*messages.recording(recording), (TRUTH, lost)])
    assert BagSource(path).ground_truth is None
    with pytest.raises(InputError, match=f'{TRUTH} has no pose that is one'):
        BagSource(path, SourceOptions(ground_truth_topic=TRUTH)).ground_truth


def test_of_two_poses_of_one_stamp_the_last_one_counts(tmp_path, recording):
    messages, moved = Messages(), np.eye(4)
    moved[0, 3] = 5.0
    rows = [(TRUTH, messages.pose('geometry_msgs/msg/PoseStamped', NS, T))
            for T in (np.eye(4), moved)]
    path = write(tmp_path / 'bag', [*messages.recording(recording), *rows])
    assert BagSource(path).ground_truth.poses[:, 0, 3].tolist() == [5.0]


def test_a_dropped_image_is_named_by_topic_and_stamp_in_seconds(tmp_path, recording):
    rows = list(stream(recording, (0.0, 0.1)))
    path = write(tmp_path / 'bag', [*rows, rows[1]])
    _, damage = read(BagSource(path))
    assert damage == [
        f'{path}, {COLOUR} at 1305031102.123456789: the stamp repeats or goes back from '
        '1305031102.223456789; the image is dropped']


def test_the_colour_camera_is_that_beside_the_depth_images_that_are_given(tmp_path, recording):
    """Of two alike."""
    make, frame = Messages(), recording.recorded[0]
    path = write(tmp_path / 'bag', [
        (f'/{side}{topic}', message) for side in ('left', 'right') for topic, message in (
            (INFO, make.info(frame.camera)),
            (COLOUR, make.image(frame.stamp, frame.colour, 'rgb8')),
            (DEPTH, make.image(frame.depth_stamp, frame.depth, '32FC1')))])
    for side in ('left', 'right'):
        source = BagSource(path, SourceOptions(depth_topic=f'/{side}{DEPTH}'))
        assert source.raw_topics == tuple(f'/{side}{topic}' for topic in (COLOUR, DEPTH, INFO))
    with pytest.raises(InputError, match='has several that may be the colour topic'):
        BagSource(path)


@pytest.mark.parametrize('count', [-5, 2 ** 63])
def test_an_impossible_count_is_quoted(bag, count):
    metadata = bag / 'metadata.yaml'
    metadata.write_text(re.sub(r'message_count: \d+', f'message_count: {count}',
                               metadata.read_text()))
    with pytest.raises(InputError) as raised:
        BagSource(bag)
    assert re.fullmatch(f'.*bag: its metadata counts {count} messages on /[a-z_/]+; run `ros2 bag '
                        'reindex` on it', str(raised.value))
