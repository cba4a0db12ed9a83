# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""All samples of an IMU in a recording, with or without images."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples, joined
from aick_ros.messages.imu import ImuBuffer
from aick_ros.sources import Kind, kind_at, raise_damage
from aick_ros.sources.bag_file import BagFile, stamp_of
from aick_ros.sources.bag_topics import BagTopics
from aick_ros.sources.tum_accelerometer import FILE, read_accelerations

_CHUNK = 10_000  # chosen: arrays need less memory than messages, and the buffer has a limit
_MOST_BATCHED = 0.25  # chosen: share of samples with the stamp of another; pairs have a half


def read_imu(path: Path, topic: str | None = None) -> ImuSamples:
    """
    Return the samples of a bag or a TUM folder, by their stamps, in the axes of the sensor.

    :param topic: of a bag; None: the only one with sensor_msgs/Imu.
    :raises InputError: where there are none, one cannot be read, or batches share their stamps.
    """
    kind = kind_at(path)
    if kind is Kind.BAG:
        return _in_order(_of_bag(path, topic), path)
    if topic is not None:
        raise InputError(f'--imu-topic has no effect on {path}, which is not a bag: omit it')
    samples = read_accelerations(path) if kind is Kind.TUM else None
    if samples is None:
        raise InputError(f'{path} has no samples of an IMU: a bag with sensor_msgs/Imu, or a TUM '
                         f'folder with {FILE}, is required')
    return samples


def _of_bag(path: Path, topic: str | None) -> ImuSamples:
    """Return the samples of a bag as they were recorded."""
    bag = BagFile(path)
    found = {name: str(info.msgtype) for name, info in bag.topics().items() if info.msgcount}
    chosen = BagTopics(found, str(path)).only_imu(topic)
    buffer, parts = ImuBuffer(), []
    for count, (_, _, message) in enumerate(bag.messages([chosen], raise_damage), 1):
        buffer.add(stamp_of(message), message)
        if count % _CHUNK == 0:
            parts.append(buffer.take(np.eye(4)))
    return joined([*parts, buffer.take(np.eye(4))])


def _in_order(samples: ImuSamples, path: Path) -> ImuSamples:
    """
    Return samples by their stamps, the first one of each.

    :raises InputError: where the stamps are those of batches: without most samples of each, white
        noise would look larger than it is.
    """
    _, first, group = np.unique(samples.stamps, return_index=True, return_inverse=True)
    values = np.hstack([samples.turn_rates, samples.accelerations])
    differs = ~np.isclose(values, values[first[group]], rtol=0.0, atol=0.0, equal_nan=True)
    batched = np.count_nonzero(differs.any(axis=1))
    if batched > _MOST_BATCHED * len(samples):
        raise InputError(f'{path}: {batched} of {len(samples)} samples of the IMU have the stamp '
                         'of another one, with other values: let its driver stamp each sample, '
                         'and record it again')
    return samples[first]
