# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""All samples of an IMU: from bags without images, from TUM folders."""

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from aick_ros.errors import InputError
from aick_ros.messages import imu
from aick_ros.sources import imu_recording
from aick_ros.sources.imu_recording import read_imu
from aick_ros.sources.writers import bag_messages


@pytest.fixture
def write(tmp_path):
    """Return a function that writes (topic, stamp, rate, force) into a bag."""
    def run(samples):
        with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            topics = {}
            for number, (topic, stamp, rate, force) in enumerate(samples):
                message = bag_messages.imu(stamp, np.array(rate), np.array(force))
                if topic not in topics:
                    topics[topic] = writer.add_connection(
                        topic, message.__msgtype__, typestore=bag_messages.TYPESTORE)
                writer.write(topics[topic], number, bag_messages.TYPESTORE.serialize_cdr(
                    message, message.__msgtype__))
        return tmp_path / 'bag'
    return run


def test_samples_of_a_bag_are_in_the_order_of_their_stamps(write, monkeypatch):
    monkeypatch.setattr(imu_recording, '_CHUNK', 2)
    monkeypatch.setattr(imu, '_MOST', 2)  # of the buffer, which forgets older ones
    path = write([('/imu', stamp, (stamp, 0.0, 0.0), (0.0, number + 1.0, 0.0))
                  for number, stamp in enumerate([20, 10, 40, 40, 30])])
    samples = read_imu(path)
    assert samples.stamps.tolist() == [10, 20, 30, 40]
    assert samples.turn_rates[:, 0].tolist() == [10, 20, 30, 40]
    assert samples.accelerations[:, 1].tolist() == [2, 1, 5, 3]


def test_batches_with_one_stamp_are_rejected(write):
    path = write([('/imu', number // 2, (number, 0.0, 0.0), (0.0, 0.0, 9.8))
                  for number in range(8)])
    with pytest.raises(InputError, match='bag: 4 of 8 samples of the IMU have the stamp of'):
        read_imu(path)


def test_messages_that_were_recorded_twice_count_once(write):
    path = write([('/imu', number // 2, (number // 2, np.nan, 0.0), (0.0, 0.0, 9.8))
                  for number in range(8)])
    assert read_imu(path).stamps.tolist() == [0, 1, 2, 3]


def test_one_of_several_topics_is_chosen(write):
    path = write([('/a/imu', 1, (1.0, 0.0, 0.0), (0.0, 0.0, 9.8)),
                  ('/b/imu', 2, (2.0, 0.0, 0.0), (0.0, 0.0, 9.8))])
    assert read_imu(path, '/b/imu').turn_rates.tolist() == [[2.0, 0.0, 0.0]]
    with pytest.raises(InputError, match='/a/imu, /b/imu: choose with --imu-topic'):
        read_imu(path)
    with pytest.raises(InputError, match='no sensor_msgs/msg/Imu on /c/imu'):
        read_imu(path, '/c/imu')


def test_an_accelerometer_of_a_tum_folder_is_read(tmp_path):
    (tmp_path / 'rgb.txt').write_text('')
    with pytest.raises(InputError, match='has no samples of an IMU'):
        read_imu(tmp_path)
    (tmp_path / 'accelerometer.txt').write_text('1.5 1 2 3\n')
    assert read_imu(tmp_path).accelerations.tolist() == [[-1.0, -2.0, 3.0]]
    with pytest.raises(InputError, match='--imu-topic has no effect'):
        read_imu(tmp_path, '/imu')


def test_a_folder_of_images_has_none(tmp_path):
    (tmp_path / 'frame-000000.color.png').write_bytes(b'')
    with pytest.raises(InputError, match='has no samples of an IMU'):
        read_imu(tmp_path)


def test_samples_that_cannot_be_read_are_one_sentence(write):
    file, = write([('/imu', 1, (1.0, 0.0, 0.0), (0.0, 0.0, 9.8))]).glob('*.mcap')
    content = file.read_bytes()
    file.write_bytes(content.replace(b'Vector3 angular_velocity', b'Vector3 angular_velocitx'))
    with pytest.raises(InputError) as raised:
        read_imu(file)
    assert str(raised.value).startswith(f'{file}, /imu: the messages are not of the type ')


def test_sentences_name_the_recording_and_what_is_required(tmp_path):
    (tmp_path / 'rgb.txt').write_text('')
    for topic, sentence in (
            (None, f'{tmp_path} has no samples of an IMU: a bag with sensor_msgs/Imu, or a TUM '
             'folder with accelerometer.txt, is required'),
            ('/imu', f'--imu-topic has no effect on {tmp_path}, which is not a bag: omit it')):
        with pytest.raises(InputError) as raised:
            read_imu(tmp_path, topic)
        assert str(raised.value) == sentence
