# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The bag player as a process: messages as recorded, with /clock, or step by step."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from rosgraph_msgs.msg import Clock

from aick_ros.ros.conversions import to_stamp
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

PLAYER_COMMAND = (sys.executable, '-c',
                  'from aick_ros.ros.process.entry_points import bag_player; bag_player()')
COUNT = 6
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine


@pytest.fixture(scope='module')
def bag(tmp_path_factory, source):
    path = tmp_path_factory.mktemp('player') / 'bag'
    bag_writer.write_bag(path, SyntheticSource(
        SyntheticOptions(frames=COUNT, camera=source.frame(0).camera), source.scene))
    return path


@pytest.fixture
def play(rig):
    """Start bag_player with its topics remapped to those of the rig's own."""
    started = []

    def start(*arguments):
        started.append(subprocess.Popen(
            [*PLAYER_COMMAND, *map(str, arguments)],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            text=True))
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
        process.stdin.close()


def listen(rig):
    from sensor_msgs.msg import Image
    images, clocks = [], []
    rig.listen(Image, bag_writer.COLOUR_TOPIC, images.append)
    rig.listen(Image, bag_writer.DEPTH_TOPIC, lambda message: None)
    rig.listen(Clock, '/clock', clocks.append)
    return images, clocks


def test_plays_what_was_recorded_with_clock(rig, play, bag):
    images, clocks = listen(rig)
    assert play(bag).wait(PATIENCE) == 0
    rig.wait_until(lambda: len(images) == COUNT, 'all images')
    for image, frame in zip(images, open_source(bag).frames(raise_damage)):
        assert to_stamp(image.header.stamp) == frame.stamp
        np.testing.assert_array_equal(
            np.frombuffer(image.data, np.uint8).reshape(240, 320, 3), frame.colour)
    stamps = [to_stamp(message.clock) for message in clocks]
    assert stamps == sorted(stamps)
    assert stamps[-1] == to_stamp(images[-1].header.stamp)


def test_step_by_step(rig, play, bag):
    images, _ = listen(rig)
    player = play(bag, '--step')
    for step in range(1, 4):
        player.stdin.write('\n')
        player.stdin.flush()
        rig.wait_until(lambda: len(images) == step, f'image {step}')
    time.sleep(0.2)  # long enough for a player that does not wait
    assert len(images) == 3
    player.stdin.close()
    assert player.wait(PATIENCE) == 0


@pytest.mark.parametrize('make, sentence', [
    (lambda folder: folder / 'nowhere', 'cannot play'),
    (lambda folder: folder, 'the folder of a ROS 2 bag is required')])
def test_a_path_that_is_no_bag_is_rejected_in_one_line(ros_domain, tmp_path, make, sentence):
    run = subprocess.run(
        [*PLAYER_COMMAND, str(make(tmp_path))],
        capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert sentence in run.stderr
    assert run.stderr.count('\n') == 1
