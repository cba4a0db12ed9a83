# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The program for PCL: wrong arguments, clouds of nothing, and its end with ours."""

import struct
import subprocess

import numpy as np
import pytest

from aick_ros.evaluation.baselines.pcl import Pcl, find_program
from aick_ros.geometry import se3

GICP = ('gicp', '0.02', '0.05', '50', '1e-5')

pytestmark = pytest.mark.skipif(find_program() is None, reason='PCL is not there: make pcl')


def surface(count=6000):
    """Return points of a wavy surface, which no motion maps onto itself."""
    x, y = np.random.default_rng(1).uniform(-1, 1, (2, count))
    z = 2 + 0.2 * np.sin(3 * x) * np.cos(2 * y) + 0.3 * x * y
    return np.column_stack([x, y, z]).astype(np.float32)


def test_finds_a_known_motion():
    T_target_source = se3.exp([0.01, -0.02, 0.015, 0.01, 0.02, -0.01])
    source = surface()
    estimate = Pcl(GICP, 4.0).register(source, se3.transform(T_target_source, source))
    error = se3.inverse(T_target_source) @ estimate.T_target_source
    assert np.linalg.norm(error[:3, 3]) < 0.002
    assert se3.angle(error[:3, :3]) < 0.002


def test_one_program_serves_all_pairs():
    pcl = Pcl(GICP, 4.0)
    nothing = np.empty((0, 3), np.float32)
    assert pcl.register(nothing, nothing).failure == 'PCL found no transform'
    assert np.allclose(pcl.register(surface(), surface()).T_target_source, np.eye(4), atol=1e-4)


def test_a_missing_program_is_an_error():
    pcl = Pcl(('icp',), 4.0)
    with pytest.raises(OSError):
        pcl.register(surface(), surface())


@pytest.mark.parametrize('arguments', [[], ['gicp'], ['gicp', 'a', '1', '1', '1']])
def test_usage_is_printed(arguments):
    process = subprocess.run([find_program(), *arguments], input=struct.pack('=2I', 0, 0),
                             capture_output=True, check=False)
    assert process.returncode == 1
    assert process.stderr.startswith(b'usage: pcl_register gicp VOXEL')
