# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bags that are written: read back by plain rosbags, by rclpy, and by our own reader."""

import dataclasses
import importlib.util
import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.writers.bag_writer import write_bag

STORAGES = pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])

READ_WITH_RCLPY = """
import json, sqlite3, sys
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image

types = {kind.__module__.split('.')[0] + '/msg/' + kind.__name__: kind
         for kind in (CameraInfo, Image, PoseStamped)}
database = sqlite3.connect(sys.argv[1])
read = []
for topic, kind, log_time, data in database.execute(
        'SELECT name, type, timestamp, data FROM messages JOIN topics ON topic_id = topics.id '
        'ORDER BY messages.id'):
    message = deserialize_message(data, types[kind])
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    row = {'topic': topic, 'log_time': log_time, 'stamp': stamp,
           'frame': message.header.frame_id}
    if kind.endswith('/Image'):
        row |= {'size': [message.width, message.height, message.step],
                'encoding': message.encoding, 'data': bytes(message.data).hex()}
    elif kind.endswith('/CameraInfo'):
        row |= {'k': list(message.k), 'd': list(message.d), 'p': list(message.p),
                'size': [message.width, message.height]}
    else:
        row['position'] = [message.pose.position.x, message.pose.position.y,
                           message.pose.position.z]
    read.append(row)
print(json.dumps(read))
"""


@STORAGES
def test_frames_come_back_bit_for_bit(tmp_path, recording, assert_same_frames, storage):
    progress = []
    written = write_bag(tmp_path / 'out', recording, storage,
                        progress=lambda *numbers: progress.append(numbers))
    assert written == 6
    assert progress == [(number, 6) for number in range(1, 7)]
    source = open_source(tmp_path / 'out')
    assert len(source) == 6
    assert_same_frames(list(source.frames(raise_damage)), recording.recorded)
    assert np.array_equal(source.ground_truth.stamps, recording.ground_truth.stamps)
    assert np.allclose(source.ground_truth.poses, recording.ground_truth.poses, atol=1e-14)


@STORAGES
@pytest.mark.parametrize('name', ['run#3', 'run?', '100%25'])
def test_a_bag_of_any_name_is_whole(tmp_path, recording, assert_same_frames, storage, name):
    write_bag(tmp_path / name, recording, storage)
    assert os.listdir(tmp_path) == [name]
    assert_same_frames(list(open_source(tmp_path / name).frames(raise_damage)),
                       recording.recorded)


@STORAGES
def test_plain_rosbags_reads_it_in_the_order_of_the_stamps(tmp_path, recording, storage):
    write_bag(tmp_path / 'out', recording, storage)
    with AnyReader([tmp_path / 'out']) as reader:
        types = {name: (info.msgtype, info.msgcount) for name, info in reader.topics.items()}
        times, poses = [], []
        for connection, time, content in reader.messages():
            message = reader.deserialize(content, connection.msgtype)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert stamp == time
            times.append(time)
            if connection.topic == '/ground_truth':
                assert message.header.frame_id == 'world'
                poses.append(message.pose)
    assert types == {
        '/camera/rgb/image_raw': ('sensor_msgs/msg/Image', 6),
        '/camera/depth/image_raw': ('sensor_msgs/msg/Image', 6),
        '/camera/rgb/camera_info': ('sensor_msgs/msg/CameraInfo', 6),
        '/ground_truth': ('geometry_msgs/msg/PoseStamped', 40)}
    assert times == sorted(times)
    for pose, expected in zip(poses, recording.ground_truth.poses, strict=True):
        q = pose.orientation
        assert np.allclose(se3.from_quaternion((q.x, q.y, q.z, q.w), (
            pose.position.x, pose.position.y, pose.position.z)), expected)


@pytest.mark.skipif(importlib.util.find_spec('rclpy') is None, reason='rclpy is not installed')
def test_rclpy_reads_it(tmp_path, recording):
    write_bag(tmp_path / 'out', recording, 'sqlite3')
    run = subprocess.run([sys.executable, '-c', READ_WITH_RCLPY, tmp_path / 'out' / 'out.db3'],
                         capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    rows = json.loads(run.stdout)
    assert [row['log_time'] for row in rows] == sorted(row['stamp'] for row in rows)
    by_topic = {topic: [row for row in rows if row['topic'] == topic]
                for topic in {row['topic'] for row in rows}}
    assert len(by_topic['/ground_truth']) == 40
    for index, frame in enumerate(recording.recorded):
        colour, depth, info = (by_topic[f'/camera/{name}'][index] for name in (
            'rgb/image_raw', 'depth/image_raw', 'rgb/camera_info'))
        assert [row['stamp'] for row in (colour, depth, info)] == [
            frame.stamp, frame.depth_stamp, frame.stamp]
        assert {row['frame'] for row in (colour, depth, info)} == {'camera_rgb_optical_frame'}
        assert (colour['encoding'], colour['size']) == ('rgb8', [32, 24, 96])
        assert (depth['encoding'], depth['size']) == ('32FC1', [32, 24, 128])
        assert bytes.fromhex(colour['data']) == frame.colour.tobytes()
        assert bytes.fromhex(depth['data']) == frame.depth.tobytes()
        assert info['k'] == frame.camera.matrix.ravel().tolist()
        assert info['d'] == list(frame.camera.distortion)
        assert info['p'] == np.hstack([frame.camera.matrix, np.zeros((3, 1))]).ravel().tolist()


def test_millimetres_are_rounded(tmp_path, recording):
    write_bag(tmp_path / 'out', recording, depth_encoding='16UC1')
    frames = open_source(tmp_path / 'out').frames(raise_damage)
    for frame, original in zip(frames, recording.recorded, strict=True):
        assert np.array_equal(np.isnan(frame.depth), np.isnan(original.depth))
        assert np.nanmax(np.abs(frame.depth - original.depth)) < 0.000501


def test_grey_and_missing_stamps_and_truth_are_no_hindrance(tmp_path, recording):
    frames = [dataclasses.replace(frame, colour=frame.colour[:, :, 0], depth_stamp=None)
              for frame in recording.recorded]
    write_bag(tmp_path / 'out', dataclasses.replace(recording, recorded=frames, ground_truth=None))
    source = open_source(tmp_path / 'out')
    assert source.ground_truth is None
    for frame, original in zip(source.frames(raise_damage), frames, strict=True):
        assert frame.depth_stamp == frame.stamp == original.stamp
        assert np.array_equal(frame.colour, original.colour)


def test_a_camera_without_distortion_comes_back(tmp_path, recording):
    camera = dataclasses.replace(recording.recorded[0].camera, distortion=())
    frames = [dataclasses.replace(frame, camera=camera) for frame in recording.recorded]
    write_bag(tmp_path / 'out', dataclasses.replace(recording, recorded=frames))
    assert next(open_source(tmp_path / 'out').frames(raise_damage)).camera == camera


@STORAGES
def test_nothing_is_left_of_an_interrupted_bag(tmp_path, recording, storage):
    def interrupt(written, total):
        if written == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_bag(tmp_path / 'out', recording, storage, progress=interrupt)
    assert os.listdir(tmp_path) == []


def test_damage_ends_the_writing_unless_it_is_listened_to(tmp_path, recording):
    recording.damage.append(InputError('one image is damaged'))
    with pytest.raises(InputError, match='one image is damaged'):
        write_bag(tmp_path / 'out', recording)
    assert os.listdir(tmp_path) == []
    damage = []
    assert write_bag(tmp_path / 'out', recording, on_damaged=damage.append) == 6
    assert damage == recording.damage


@pytest.mark.parametrize('changes, reason', [
    ({'storage': 'tape'}, "no bag storage 'tape': use one of mcap, sqlite3"),
    ({'depth_encoding': '8UC1'}, "'8UC1': use 32FC1 or 16UC1")])
def test_unknown_formats_are_rejected(tmp_path, recording, changes, reason):
    with pytest.raises(InputError, match=reason):
        write_bag(tmp_path / 'out', recording, **changes)
    assert os.listdir(tmp_path) == []


def test_nothing_is_written_without_frames(tmp_path, recording):
    with pytest.raises(InputError, match='in memory has no frames to write'):
        write_bag(tmp_path / 'out', dataclasses.replace(recording, recorded=[]))
    assert os.listdir(tmp_path) == []


def test_an_existing_bag_is_left_alone(tmp_path, recording):
    write_bag(tmp_path / 'out', recording)
    before = (tmp_path / 'out' / 'out.mcap').read_bytes()
    with pytest.raises(InputError, match='out exists already: remove it or choose another name$'):
        write_bag(tmp_path / 'out', recording)
    assert (tmp_path / 'out' / 'out.mcap').read_bytes() == before


def test_real_frames_come_back_bit_for_bit(tmp_path, real_folder, assert_same_frames):
    source = open_source(real_folder)
    source._pairs = source._pairs[:10]
    write_bag(tmp_path / 'out', source)
    assert_same_frames(list(open_source(tmp_path / 'out').frames(raise_damage)),
                       list(source.frames(raise_damage)))


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from aick_ros.errors import InputError
from aick_ros.sources import open_source
from aick_ros.sources.writers.bag_writer import write_bag
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
source = open_source(sys.argv[2])
for storage in 'mcap', 'sqlite3':
    for size in 0, 5000, 20_000:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, -1))
        try:
            write_bag(Path(sys.argv[1]), source, storage)
        except InputError as error:
            sys.stdout.write(f'{error}|')
"""


def test_nothing_is_left_on_a_full_disk(tmp_path, recorded_folder):
    before = sorted(os.listdir(tmp_path))
    run = subprocess.run([sys.executable, '-c', FULL_DISK, tmp_path / 'out', recorded_folder],
                         capture_output=True, text=True)
    assert run.stderr == ''
    sentences = run.stdout.split('|')[:-1]
    assert len(sentences) == 6
    assert all(text.startswith(f'cannot write {tmp_path}/out: ') for text in sentences)
    assert sorted(os.listdir(tmp_path)) == before


@pytest.mark.parametrize('lag', [-70_000_000, 70_000_000])
def test_messages_are_in_order_where_depth_lags_by_frames(tmp_path, recording, lag):
    recording.recorded[:] = [dataclasses.replace(frame, depth_stamp=frame.stamp + lag)
                             for frame in recording.recorded]
    write_bag(tmp_path / 'out', recording, 'sqlite3')
    with closing(sqlite3.connect(tmp_path / 'out' / 'out.db3')) as database:
        times = [time for time, in database.execute('SELECT timestamp FROM messages ORDER BY id')]
    assert len(times) == 6 * 3 + 40
    assert times == sorted(times)
