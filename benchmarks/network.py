# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The camera on one host and the node on another, joined by a network that loses frames.

    sudo python benchmarks/network.py --seconds 20

The hosts are namespaces of this machine, see lossy_link.py: 1 ms of delay and 1 % of the Ethernet
frames lost by chance in each direction, as netem would, but done by a process. Wi-Fi itself
retransmits, and loses in bursts: this is neither. Images are 640x480, rendered, at 30 Hz,
reliable unless it says otherwise.
The path is compared to that of all frames registered offline.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from camera import to_and_fro
from life_cycle import recording
from lossy_link import LossyLink, NotAllowed
from node_process import Listener, NodeProcess
from row import HEAD, Row

from aick_ros.evaluation.scores.consistency import Consistency, nees
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose
from aick_ros.ros.process.resources import config_file, profiles_variable, use_fastdds_profile
from aick_ros.settings.presets import preset

PATIENCE = 20.0  # seconds from the last frame published to the end
PRESET = 'paper-fast'  # the network is measured, not the processor
SHARE = 0.95  # of the frames answered, and of the poses within their covariance
_SETTLED = 2.0  # seconds after the device is up again
_SHORTEST = 15.0  # seconds; an interruption begins after some, lasts 5 and is given time to settle


@dataclass(frozen=True)
class Case:
    """
    One measurement.

    :param profile: of Fast DDS on the camera's host; on the node's it is always the usual one.
    """

    name: str
    profile: str = 'fastdds_wireless.xml'
    loss: float = 0.01
    delay: float = 0.001  # seconds
    rate: float = 30.0
    compressed: bool = True
    best_effort: bool = False
    clock_offset: float = 0.0
    down: float = 0.0
    must: float = SHARE

    @property
    def camera_options(self) -> list[str]:
        """Arguments of camera.py."""
        options = ['--rate', str(self.rate), '--clock-offset', str(self.clock_offset)]
        options += ['--compressed'] if self.compressed else []
        return options + (['--best-effort'] if self.best_effort else [])

    @property
    def node_parameters(self) -> dict[str, str]:
        """Parameters of the node that differ from the defaults."""
        # on a loaded machine frames are late, but not dropped for that
        parameters = {'process_every_frame': 'true', 'preset': PRESET}
        if self.compressed:
            parameters.update(image_transport='compressed', depth_transport='compressed')
        return parameters


@dataclass
class Outcome:
    """
    What came of a case.

    :param stamps: of the frames published [ns].
    :param received: stamp -> time of the answer and the odometry.
    :param up_at: when the device was up again, 0 where it never was down.
    """

    stamps: list[int]
    received: dict = field(default_factory=dict)
    up_at: float = 0.0
    megabits: float = 0.0  # per second
    lost: float = 0.0
    dropped: int = 0  # by the devices


USUAL = 'fastdds.xml'
CASES = (
    Case('compressed, no loss, usual profile', USUAL, loss=0.0),
    Case('compressed, usual profile', USUAL, must=0.0),
    Case('compressed'),
    Case('compressed, best effort', best_effort=True, must=0.0),
    Case('raw, usual profile', USUAL, compressed=False, must=0.0),
    Case('raw', compressed=False),
    Case("compressed, camera's clock 50 ms ahead", clock_offset=0.05),
    Case("compressed, camera's clock 50 ms behind", clock_offset=-0.05),
    Case('compressed, interface down for 5 s', down=5.0),
)


def run(case: Case, frames: Path, seconds: float) -> Outcome:
    """Have a camera on one host show frames to the node on the other."""
    file = frames.with_name('stamps.npy')
    with LossyLink(case.loss, case.delay) as link:
        shoot = link.camera.command(
            sys.executable, str(Path(__file__).with_name('camera.py')), str(frames), '--seconds',
            str(seconds), '--stamps', str(file), *case.camera_options)
        with (link.robot.entered(), Listener() as listener,
              NodeProcess(**case.node_parameters)):
            camera = subprocess.Popen(
                shoot, stdout=subprocess.PIPE,
                env={**os.environ, profiles_variable(): str(config_file(case.profile))})
            outcome = Outcome([], listener.received)
            if case.down:
                if not listener.wait_for_any(PATIENCE):
                    sys.exit(f'{case.name}: no odometry before the interruption')
                time.sleep(2.0)
                link.robot.set_up(False)
                time.sleep(case.down)
                link.robot.set_up(True)
                outcome.up_at = time.time()
            camera.communicate()
            if camera.returncode:
                sys.exit(f'{case.name}: the camera ended with {camera.returncode}')
            outcome.stamps = np.load(file).tolist()
            listener.wait_for(outcome.stamps[-1], PATIENCE)
            traffic = link.traffic
            outcome.lost = traffic.lost / max(traffic.frames, 1)
            outcome.megabits = 8 * traffic.megabytes / seconds
            outcome.dropped = link.camera.drops() + link.robot.drops()
    return outcome


def path_consistency(case: Case, outcome: Outcome, frames: Path) -> Consistency:
    """Return how the path differs from that without loss, by the covariance it states."""
    content = np.load(frames)
    order = to_and_fro(len(content['depth']))
    odometry = Odometry(preset(PRESET))
    camera = Camera(*content['depth'].shape[:0:-1], *content['k'][[0, 1, 0, 1], [0, 1, 2, 2]])
    images = [_seen(colour, case.compressed) for colour in content['colour']]
    depths = [np.where(depth, depth / np.float32(1000), np.float32(np.nan))
              for depth in content['depth']]
    T_first, values = None, []
    for i, stamp in enumerate(outcome.stamps):
        k = order[i % len(order)]
        T = odometry.register_frame(
            RgbdFrame(stamp, images[k], depths[k], camera)).T_odom_camera
        if stamp in outcome.received:
            pose = outcome.received[stamp][1].pose
            if T_first is None:
                T_first = T
            else:
                values.append(nees(
                    se3.difference(from_pose(pose.pose), se3.inverse(T_first) @ T),
                    np.reshape(pose.covariance, (6, 6))))
    return Consistency.of(values)


def rows(case: Case, outcome: Outcome, frames: Path, command: str) -> Iterator[Row]:
    """Yield what was measured in one case."""
    delays = [1e3 * (at + case.clock_offset) - 1e-6 * stamp
              for stamp, (at, _) in outcome.received.items()]
    remark = (f'{outcome.megabits:.0f} Mbit/s, {100 * outcome.lost:.2f} % of the frames lost, '
              f'{outcome.dropped} dropped by the devices')
    if delays:
        remark += (f', delay {np.percentile(delays, 50):.0f} ms, 99 %: '
                   f'{np.percentile(delays, 99):.0f} ms')
    stamps = outcome.stamps
    if case.down:
        first = min(at for at, _ in outcome.received.values() if at > outcome.up_at)
        yield Row(f'{case.name}: first odometry after it is up', 5, False,
                  first - outcome.up_at, 's', command)
        since = 1e9 * (outcome.up_at + _SETTLED)
        stamps = [stamp for stamp in stamps if stamp > since]
        remark += f', of those published {_SETTLED:g} s after it is up'
    answered = sum(stamp in outcome.received for stamp in stamps)
    yield Row(f'{case.name}: frames answered', case.must, True, answered / len(stamps), '',
              command, remark)
    if len(outcome.received) > 1 and not case.down:
        consistency = path_consistency(case, outcome, frames)
        yield Row(f'{case.name}: poses within 95 % of their covariance around those without '
                  'loss', SHARE if case.must else 0.0, True, consistency.inside_95 or 0.0, '',
                  command, f'mean NEES {consistency.nees_mean:.2g}')


def _seen(colour: np.ndarray, compressed: bool) -> np.ndarray:
    if not compressed:
        return colour
    return cv2.imdecode(cv2.imencode('.jpg', colour[..., ::-1])[1], cv2.IMREAD_COLOR)[..., ::-1]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--only', default='', help='cases whose name contains this')
    arguments = parser.parse_args()
    if arguments.seconds < _SHORTEST:
        parser.error(f'--seconds must be {_SHORTEST:g} or more, not {arguments.seconds:g}')
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'  # of the namespaces
    use_fastdds_profile()
    command = f'python benchmarks/network.py --seconds {arguments.seconds:g}'
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    with tempfile.TemporaryDirectory() as folder:
        frames = recording(Path(folder))
        for case in CASES:
            if arguments.only in case.name:
                try:
                    outcome = run(case, frames, arguments.seconds)
                except NotAllowed as error:
                    sys.exit(f'hosts cannot be made here: {error}')
                for row in rows(case, outcome, frames, command):
                    print(row, flush=True)


if __name__ == '__main__':
    main()
