# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measures the node from outside, over DDS, and prints what it shows beside what it must.

    python benchmarks/node.py --seconds 60 --minutes 20 --damaged 100000

Camera, node and listener are three processes on this machine; the images are rendered. Single
rows: ``--only live,fast,slow_core,large,start,equal,damage,memory``. Nothing else should run
meanwhile.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from camera import FRAME, image_message, to_and_fro
from damage import Damage
from node_camera import CAMERAS, FRAMES, Plan, camera, shoot
from node_process import Listener, NodeProcess
from node_rates import fast, slow_core
from row import HEAD, Row
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.synchronizer import Pair
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, header
from aick_ros.ros.process.resources import use_fastdds_profile

CHUNK = 40  # damaged pairs between two good ones; the backlog takes 100
PERIOD = 33_333_333  # ns


def live(plan: Plan) -> Iterator[Row]:
    """Losses, delay and processor at 640x480 and 30 Hz with the default settings."""
    command = f'python benchmarks/node.py --only live --seconds {plan.seconds:g}'
    with Listener() as listener, NodeProcess() as node:
        sent, cpu = shoot(plan.recording('640x480'), plan.seconds, node)
    delays = 1e3 * np.array([at - stamp / 1e9 for stamp, (at, _) in listener.received.items()])
    yield Row(f'640x480 at 30 Hz, {plan.seconds:g} s: frames lost', 0, False,
              sent - len(delays), f'of {sent}', command)
    median, slow = np.percentile(delays, (50, 99))
    yield Row('the same: delay from publish to odometry, median', 40, False, median, 'ms', command)
    yield Row('the same: delay, 99th percentile', 80, False, slow, 'ms', command)
    yield Row('the same: processor of the node', 1.2, False, cpu, 'cores', command)


def large(plan: Plan) -> Iterator[Row]:
    """Rate at 1280x720 and 30 Hz where only the newest frame counts."""
    seconds = min(plan.seconds, 30.0)
    with Listener() as listener, NodeProcess() as node:
        _, cpu = shoot(plan.recording('1280x720'), seconds, node)
    yield Row('1280x720 at 30 Hz, newest frame: odometry', 12, True,
              len(listener.received) / seconds, 'Hz', 'python benchmarks/node.py --only large',
              f'{cpu:.2f} cores')


def start(plan: Plan) -> Iterator[Row]:
    """From the start of the process to its first odometry, with a camera running."""
    times = []
    with Listener() as listener, camera(plan.recording('640x480'), 60.0, '--at-once'):
        time.sleep(4.0)  # until it runs
        for _ in range(5):
            time.sleep(1.0)  # until the last answers of the node before have come
            begun = time.time_ns()
            with NodeProcess():
                _wait(lambda: max(listener.received, default=0) > begun, 20.0)
                times.append(1e-9 * (time.time_ns() - begun))
    yield Row('start to first odometry, a camera running', 3.0, False, float(np.median(times)),
              's', 'python benchmarks/node.py --only start', f'worst of 5: {max(times):.2f} s')


def equal(plan: Plan) -> Iterator[Row]:
    """The path over DDS against the one offline, and both with damaged messages between."""
    yield from _compare(plan, 0, 'raw', 'equal')


def damage(plan: Plan) -> Iterator[Row]:
    """Damaged messages between good ones, raw and compressed."""
    for transport in ('raw', 'compressed'):
        yield from _compare(plan, plan.damaged // 2, transport, 'damage')


def memory(plan: Plan) -> Iterator[Row]:
    """
    Resident memory in the last minute against that in the one after the first, their means.

    At single moments it differs by 10 MB: images wait for their frames, and what was freed is
    given back to the system every ten seconds.
    """
    command = f'python benchmarks/node.py --only memory --minutes {plan.minutes:g}'
    with Listener(), NodeProcess() as node:
        with camera(plan.recording('640x480'), 60.0 * plan.minutes) as process:
            sizes = []
            while process.poll() is None:
                sizes.append(node.resident_megabytes)
                time.sleep(1.0)
    minute = min(60, len(sizes) // 3)
    early, late = sizes[minute:2 * minute], sizes[-minute:]
    yield Row(f'memory after {plan.minutes:g} min at 30 Hz against after the first', 4, False,
              float(np.mean(late) - np.mean(early)), 'MB', command,
              f'{min(late):.0f} to {max(late):.0f} MB in all, {min(early):.0f} to '
              f'{max(early):.0f} in the second minute')


MEASURES: tuple[Callable[[Plan], Iterator[Row]], ...] = (
    live, fast, slow_core, large, start, equal, damage, memory)
"""Measurements, in order; add a function that yields rows."""


def _wait(condition: Callable[[], object], seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            sys.exit(f'waited {seconds:g} s in vain')
        time.sleep(0.005)


class _Rig:
    """Publishes good and damaged pairs of a transport, and compares the answers to offline."""

    def __init__(self, listener: Listener, recording: Path, transport: str) -> None:
        content, node, self._listener = np.load(recording), listener.node, listener
        suffix, kind = ('', Image) if transport == 'raw' else ('/compressed', CompressedImage)
        self._publishers = [node.create_publisher(kind, f'{name}{suffix}', 1000)
                            for name in ('rgb/image', 'depth/image')]
        self._info_publisher = node.create_publisher(CameraInfo, 'rgb/camera_info', 1000)
        self._camera = CAMERAS['640x480']
        self._info = CameraInfo(
            width=self._camera.width, height=self._camera.height, k=content['k'].ravel(),
            distortion_model='plumb_bob', d=[0.0] * 5)
        raw = [(image_message(colour, 'rgb8'), image_message(depth, '16UC1'))
               for colour, depth in zip(content['colour'], content['depth'])]
        self._damage = Damage((*raw[0], self._info))
        self._is_raw = transport == 'raw'
        self._good = raw if self._is_raw else [
            (_png(colour[..., ::-1]), _png(depth))
            for colour, depth in zip(content['colour'], content['depth'])]
        self._decoder = FrameDecoder()
        self._odometry = Odometry()
        self._stamp = time.time_ns() - 10 ** 13  # stamps of the future would be refused
        self.damaged = 0

    def connect(self) -> None:
        """Wait until the node listens, and knows the camera."""
        _wait(lambda: all(publisher.get_subscription_count() for publisher in (
            *self._publishers, self._info_publisher)), 20.0)
        time.sleep(1.0)
        self._publish(self._info_publisher, self._info)

    def good(self, index: int) -> float | None:
        """Send a good frame; return how far its answer is from offline, None without any."""
        self._send(self._good[index])
        expected = self._odometry.register_frame(self._decode(self._good[index]))
        if not self._listener.wait_for(self._stamp, 10.0):
            return None
        _, message = self._listener.received.pop(self._stamp)
        return float(np.abs(from_pose(message.pose.pose) - expected.T_odom_camera).max())

    def bad(self, count: int) -> None:
        """Send so many damaged messages; some are images, without any depth for example."""
        for _ in range(count // 2):
            pair = (self._damage.pair() if self._is_raw
                    else self._damage.compressed_pair(self._good[0]))
            self._send(pair)
            try:
                self._odometry.register_frame(self._decode(pair))
            except InputError:
                pass
        self._publish(self._info_publisher, self._damage.camera_info())
        self.damaged += 2 * (count // 2) + 1

    def _decode(self, pair: tuple) -> RgbdFrame:
        colour, depth = pair
        return self._decoder.decode(Pair(self._stamp, colour, self._stamp, depth), self._camera)

    def _send(self, pair: tuple) -> None:
        self._stamp += PERIOD
        for publisher, message in zip(self._publishers, pair):
            self._publish(publisher, message)

    def _publish(self, publisher: object, message: object) -> None:
        message.header = header(self._stamp, FRAME)
        publisher.publish(message)


def _png(image: np.ndarray) -> CompressedImage:
    return CompressedImage(format='png', data=array(
        'B', cv2.imencode('.png', image)[1].tobytes()))


def _compare(plan: Plan, damaged: int, transport: str, name: str) -> Iterator[Row]:
    command = f'python benchmarks/node.py --only {name} --damaged {plan.damaged}'
    order, apart = to_and_fro(FRAMES), []
    with Listener() as listener, NodeProcess(
            process_every_frame='true', qos_reliability='reliable', topic_queue_size=1000,
            image_transport=transport, depth_transport=transport) as node:
        rig = _Rig(listener, plan.recording('640x480'), transport)
        rig.connect()
        for i in range(max(len(order), damaged // (2 * CHUNK))):
            apart.append(rig.good(order[i % len(order)]))
            if damaged:
                rig.bad(2 * CHUNK)
        alive, megabytes = node.alive, node.resident_megabytes
    answered = [distance for distance in apart if distance is not None]
    what = f'{transport}, {rig.damaged} damaged messages between' if damaged else transport
    yield Row(f'{what}: good frames without an answer', 0, False,
              len(apart) - len(answered), f'of {len(apart)}', command,
              f'the node {"runs on" if alive else "HAS ENDED"}, {megabytes:.0f} MB')
    yield Row(f'{what}: path over DDS against offline', 1e-6, False,
              max(answered, default=np.inf), '', command)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--minutes', type=float, default=20.0)
    parser.add_argument('--damaged', type=int, default=100_000)
    names = [measure.__name__ for measure in MEASURES]
    parser.add_argument('--only', default=','.join(names))
    arguments = parser.parse_args()
    chosen = arguments.only.split(',')
    if not set(chosen) <= set(names):
        parser.error(f'--only takes {",".join(names)}')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    use_fastdds_profile()
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    with tempfile.TemporaryDirectory() as folder:
        plan = Plan(Path(folder), arguments.seconds, arguments.minutes, arguments.damaged)
        for measure in MEASURES:
            if measure.__name__ in chosen:
                for row in measure(plan):
                    print(row, flush=True)


if __name__ == '__main__':
    main()
