# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Each example runs, on a small rendered recording, and its result is the exact one."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aick_ros import Camera, PoseWithCovariance, open_source
from aick_ros.geometry import se3
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

EXAMPLES = Path(__file__).parents[2] / 'examples'
FRAMES, RATE = 12, 10.0


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    """Return the folder of a rendered recording."""
    folder = tmp_path_factory.mktemp('recording') / 'room'
    write_tum(folder, SyntheticSource(SyntheticOptions(
        seed=2, frames=FRAMES, rate=RATE, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5))))
    return folder


def run(name, *arguments):
    """Return the lines that an example prints."""
    done = subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def motion(recording, count):
    """Return the exact motion over the first frames, ``T_first_last``."""
    frames = [frame.stamp for frame in open_source(recording).frames()]
    path = open_source(recording).ground_truth
    return se3.inverse(path.at(frames[0])) @ path.at(frames[count])


def numbers(text):
    return [float(number) for number in re.findall(r'-?\d+\.\d*(?:e-?\d+)?|-?\d+\.', text)]


def test_every_example_has_a_test():
    own = Path(__file__).read_text()
    assert [file.name for file in EXAMPLES.glob('*.py') if f"'{file.name}'" not in own] == []


def test_odometry(recording):
    lines = run('odometry.py', recording)
    assert [line.split()[2] for line in lines] == ['FIRST_FRAME'] + (FRAMES - 1) * ['OK']
    position = numbers(lines[-1].partition('[')[2].partition(']')[0])
    np.testing.assert_allclose(position, motion(recording, FRAMES - 1)[:3, 3], atol=0.02)


def test_two_frames_by_the_paper(recording):
    first, *rows = run('register_two_frames.py', recording, 3)
    assert first.startswith('registered')
    found = np.reshape(numbers(' '.join(rows)), (4, 4))
    error = se3.inverse(motion(recording, 3)) @ found
    assert np.linalg.norm(error[:3, 3]) < 0.02
    assert se3.angle(error[:3, :3]) < np.radians(1.0)


def test_custom_detector(recording):
    lines = run('custom_detector.py', recording)
    assert [line.split()[0] for line in lines] == ['FIRST_FRAME'] + (FRAMES - 1) * ['OK']


def test_custom_source(recording, tmp_path):
    frames = list(open_source(recording).frames())
    np.savez(tmp_path / 'own.npz', stamps=[1e-9 * frame.stamp for frame in frames],
             colour=[frame.colour for frame in frames],
             depth=[np.nan_to_num(1e3 * frame.depth).round().astype(np.uint16)
                    for frame in frames],
             k=frames[0].camera.matrix)
    lines = run('custom_source.py', tmp_path / 'own.npz')
    assert [line.split()[0] for line in lines] == ['FIRST_FRAME'] + (FRAMES - 1) * ['OK']
    np.testing.assert_allclose(numbers(lines[-1]), motion(recording, FRAMES - 1)[:3, 3],
                               atol=0.02)


def test_fused_positions(recording):
    *_, last = run('fuse_positions.py', recording)
    error, sigma = numbers(last.partition('error')[2])
    assert error < 4 * sigma < 0.1e3


def test_the_update_of_the_filter_is_that_of_two_gaussians():
    """A position with a Gaussian prior and a Gaussian measurement: the product of the two."""
    position_filter = runpy.run_path(str(EXAMPLES / 'fuse_positions.py'))['PositionFilter'](
        PoseWithCovariance(np.eye(4), np.diag([0.04, 0.01, 0.0025, 0.01, 0.01, 0.01])))
    position_filter.update(np.array([1.0, 1.0, 1.0]), 0.1)
    precision = 1 / np.array([0.04, 0.01, 0.0025]) + 100
    np.testing.assert_allclose(position_filter.pose.translation, 100 / precision)
    np.testing.assert_allclose(np.diag(position_filter.pose.covariance)[:3], 1 / precision)
    np.testing.assert_allclose(position_filter.pose.rotation, np.eye(3))
