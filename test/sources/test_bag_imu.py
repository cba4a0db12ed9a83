# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of an IMU in a bag: with their frames, in the axes of the camera, or not at all."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples, joined
from aick_ros.geometry import se3
from aick_ros.messages.synchronizer import Pair
from aick_ros.sources import bag_cameras, open_source, raise_damage
from aick_ros.sources.bag_imu import BagImu
from aick_ros.sources.bag_topics import IMU, BagTopics
from aick_ros.sources.writers import bag_messages
from aick_ros.sources.writers.bag_writer import IMU_TOPIC, write_bag

PERIOD = 5_000_000  # ns


@pytest.fixture
def inertial(recording):
    """Return the recording with samples up to 20 ms after each frame; two have no acceleration."""
    rng, first, end = np.random.default_rng(2), recording.recorded[0].stamp, None
    frames = []
    for frame in recording.recorded:
        start = first - 100_000_000 if end is None else end
        end = frame.stamp + 20_000_000
        stamps = np.arange(first - 100_000_000, end, PERIOD, dtype=np.int64)
        stamps = stamps[stamps >= start]
        force = rng.normal(size=(len(stamps), 3))
        force[:2] = np.nan
        frames.append(dataclasses.replace(
            frame, imu=ImuSamples(stamps, rng.normal(size=(len(stamps), 3)), force)))
    return dataclasses.replace(recording, recorded=frames)


def sample():
    """Return the message of a sensor at rest."""
    vector = SimpleNamespace(x=0.0, y=0.0, z=9.8)
    return SimpleNamespace(
        header=SimpleNamespace(frame_id='imu'), angular_velocity=vector,
        angular_velocity_covariance=np.zeros(9), linear_acceleration=vector,
        linear_acceleration_covariance=np.zeros(9))


def read(path):
    return list(open_source(path).frames(raise_damage))


def test_samples_come_back_bit_for_bit_and_reach_their_frames(tmp_path, inertial):
    write_bag(tmp_path / 'out', inertial)
    frames = read(tmp_path / 'out')
    assert [frame.stamp for frame in frames] == [frame.stamp for frame in inertial.recorded]
    written = joined([frame.imu for frame in inertial.recorded])
    found = joined([frame.imu for frame in frames])
    for name in ('stamps', 'turn_rates', 'accelerations'):
        np.testing.assert_array_equal(getattr(found, name),
                                      getattr(written, name)[:len(found)])
    assert all(frame.imu.stamps[-1] >= frame.stamp for frame in frames)


def test_a_pair_is_released_by_the_sample_that_reaches_it():
    """Or by the next pair, whichever comes first in the bag."""
    imu = BagImu('/imu', lambda *_: np.eye(4))
    first, second, third = (Pair(100 * n, f'colour {n}', 100 * n, f'depth {n}') for n in (1, 2, 3))
    assert not list(imu.add(90, sample())) and not list(imu.wait([first]))
    assert not list(imu.add(99, sample()))
    assert list(imu.add(100, sample())) == [first]
    assert not list(imu.wait([second]))
    assert list(imu.wait([third])) == [second]
    assert list(imu.add(300, sample())) == [third]
    assert not list(imu.flush())


def test_an_imu_that_ends_keeps_no_frame_waiting(tmp_path, inertial):
    inertial.recorded[2:] = [dataclasses.replace(frame, imu=None)
                             for frame in inertial.recorded[2:]]
    write_bag(tmp_path / 'out', inertial)
    frames = read(tmp_path / 'out')
    assert len(frames) == 6
    assert sum(len(frame.imu) for frame in frames) == sum(
        len(frame.imu) for frame in inertial.recorded[:2])


@pytest.mark.parametrize('known', [False, True])
def test_samples_are_turned_into_the_axes_of_the_camera(tmp_path, inertial, monkeypatch, known):
    frames_of, turn = bag_messages.imu, se3.exp([1, 2, 3, 0.3, -0.4, 2.0])

    def in_its_own_frame(*values):
        message = frames_of(*values)
        message.header.frame_id = 'imu_frame'
        return message

    monkeypatch.setattr(bag_messages, 'imu', in_its_own_frame)
    write_bag(tmp_path / 'out', inertial)
    if known:
        tree = bag_cameras.FrameTree()
        tree.set_static(bag_messages.OPTICAL_FRAME, 'imu_frame', turn)
        monkeypatch.setattr(bag_cameras.BagCameras, '_frames', tree)
    imu = [frame.imu for frame in read(tmp_path / 'out')]
    if not known:
        assert imu == 6 * [None]
        return
    written = joined([frame.imu for frame in inertial.recorded]).turn_rates
    np.testing.assert_allclose(joined(imu).turn_rates[:50], written[:50] @ turn[:3, :3].T,
                               atol=1e-12)


@pytest.mark.parametrize('topics, chosen', [
    (['/imu/data'], '/imu/data'), (['/camera/accel/sample'], None), ([], None),
    (['/camera/accel/sample', '/camera/gyro/sample'], '/camera/gyro/sample'),
    (['/base/imu', '/camera/imu', '/zed/imu'], '/camera/imu')])
def test_a_gyroscope_beside_the_camera_is_chosen(topics, chosen):
    assert BagTopics(dict.fromkeys(topics, IMU), 'a bag').imu('/camera/rgb/image') == chosen


def test_why_an_imu_is_not_used_is_remarked(tmp_path, inertial, monkeypatch):
    write_bag(tmp_path / 'out', inertial)
    source = open_source(tmp_path / 'out')
    assert source.remarks == [] and len(list(source.frames(raise_damage)))
    assert source.remarks == []
    monkeypatch.setattr(bag_cameras.BagCameras, 'in_colour', lambda *_: None)
    source = open_source(tmp_path / 'out')
    frames = source.frames(raise_damage)
    assert next(frames).imu is None
    remark, = source.remarks
    assert remark.startswith(
        f'{tmp_path}/out: the IMU on {IMU_TOPIC} is not used, as no transform from ')
    assert remark.endswith('is on /tf_static: record it, too')


def test_an_imu_that_measures_nothing_is_remarked(tmp_path, inertial):
    nothing = []
    for frame in inertial.recorded:  # at 1 kHz: a few such samples are no complaint
        stamps = (frame.imu.stamps[:, None] + 1_000_000 * np.arange(5)).ravel()
        unmeasured = np.full((len(stamps), 3), np.nan)
        nothing.append(dataclasses.replace(frame, imu=ImuSamples(stamps, unmeasured, unmeasured)))
    write_bag(tmp_path / 'out', dataclasses.replace(inertial, recorded=nothing))
    source = open_source(tmp_path / 'out')
    list(source.frames(raise_damage))
    remark, = source.remarks
    assert (f'samples of the IMU on {IMU_TOPIC} have neither a turn rate nor an acceleration'
            in remark)


@pytest.mark.parametrize('shift, difference', [
    (10.0, '10.0 s ahead of'), (-1.2, '1.2 s behind'), (0.9, ''), (-0.9, '')])
def test_another_clock_of_an_imu_is_remarked(tmp_path, inertial, monkeypatch, shift, difference):
    """Samples are in the bag up to 20 ms after their image."""
    imu = bag_messages.imu
    monkeypatch.setattr(bag_messages, 'imu', lambda stamp, *values: imu(
        stamp + round(shift * 1e9), *values))
    write_bag(tmp_path / 'out', inertial)
    source = open_source(tmp_path / 'out')
    assert len(list(source.frames(raise_damage))) == 6
    assert source.remarks == ([
        f'{tmp_path}/out: the samples of the IMU on {IMU_TOPIC} are stamped {difference} the '
        'images and are not used: let both drivers stamp by one clock'] if difference else [])


@pytest.mark.parametrize('interval', [1.1, 2.0, 5.0, 60.0])
def test_a_camera_below_1_hz_has_the_clock_of_its_imu(tmp_path, recording, interval):
    """Its images wait for the next one in the bag, and samples come meanwhile."""
    first, period = recording.recorded[0].stamp, round(interval * 1e9)
    frames = []
    for index, frame in enumerate(recording.recorded):
        stamp = first + index * period
        stamps = np.arange(stamp - period, stamp, period // 10) + 20_000_000
        values = np.random.default_rng(index).normal(size=(len(stamps), 3))
        frames.append(dataclasses.replace(
            frame, stamp=stamp, depth_stamp=stamp, imu=ImuSamples(stamps, values, values)))
    write_bag(tmp_path / 'out', dataclasses.replace(recording, recorded=frames))
    source = open_source(tmp_path / 'out')
    assert len(list(source.frames(raise_damage))) == len(frames)
    assert source.remarks == []


def pairs_of(imu, first, samples):
    """Have a pair per sample pass, 100 ms apart [ms]; a sample that is None does not come."""
    for index, stamp in enumerate(samples):
        if stamp is not None:
            list(imu.add(stamp * 10 ** 6, sample()))
        list(imu.wait([Pair((first + 100 * index) * 10 ** 6, 'colour', 0, 'depth')]))


def test_a_few_samples_with_stamps_since_boot_are_no_other_clock():
    imu = BagImu('/imu', lambda *_: np.eye(4))
    pairs_of(imu, 100_000, [100, 200, 300, *range(100_300, 102_000, 100)])
    assert imu.remarks == []


def test_another_clock_stays_remarked_when_the_images_reach_its_stamps():
    imu = BagImu('/imu', lambda *_: np.eye(4))
    pairs_of(imu, 0, range(2000, 6000, 100))
    remark, = imu.remarks
    assert remark.startswith('the samples of the IMU on /imu are stamped 2.0 s ahead of the ')


@pytest.mark.parametrize('samples', [
    pytest.param([5000, *30 * [None]], id='ends'),
    pytest.param([0, *range(5100, 7000, 100)], id='stray')])
def test_an_imu_that_ends_and_a_stray_stamp_are_no_other_clock(samples):
    imu = BagImu('/imu', lambda *_: np.eye(4))
    pairs_of(imu, 5000, samples)
    assert imu.remarks == []
