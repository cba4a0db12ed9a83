# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""GICP and 3D-NDT of the Point Cloud Library, in the program of ``benchmarks/pcl/``."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from aick_ros.evaluation.baselines import Estimate
from aick_ros.evaluation.baselines.dense import point_cloud
from aick_ros.frames.rgbd import RgbdFrame

_POSE_BYTES = 16 * 8  # by definition: 4x4 float64
_BUILT = Path(__file__).parents[3] / 'build' / 'pcl' / 'pcl_register'


def find_program() -> str | None:
    """Return the program, built by ``make pcl`` or on the PATH; None where there is none."""
    return str(_BUILT) if os.access(_BUILT, os.X_OK) else shutil.which('pcl_register')


class Pcl:
    """
    One registration method of PCL, from the identity; nothing is shared between pairs.

    :param arguments: arguments of the program: the method and its settings.
    :param max_depth: farther points are ignored [m].
    :raises OSError: where the program is missing.
    """

    def __init__(self, arguments: Sequence[str], max_depth: float) -> None:
        self._max_depth = max_depth
        self._process = subprocess.Popen([find_program() or 'pcl_register', *arguments],
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._input, self._output = self._process.stdin, self._process.stdout

    def __del__(self) -> None:
        """End the program."""
        self._input.close()
        self._output.close()
        self._process.kill()
        self._process.wait()

    def prepare(self, frame: RgbdFrame) -> np.ndarray:
        """Return the points, Nx3 float32 [m]."""
        return point_cloud(frame, self._max_depth).astype(np.float32)

    def register(self, source: np.ndarray, target: np.ndarray) -> Estimate:
        """
        Return the transform.

        :raises OSError: where the program has ended.
        """
        stream = self._input
        stream.write(struct.pack('=2I', len(source), len(target)))
        stream.write(source.tobytes())
        stream.write(target.tobytes())
        stream.flush()
        answer = self._output.read(_POSE_BYTES)
        if len(answer) < _POSE_BYTES:
            raise OSError(f'pcl_register ended with exit code {self._process.wait()}')
        T_target_source = np.frombuffer(answer).reshape(4, 4)
        if not np.isfinite(T_target_source).all():
            return Estimate(None, 'PCL found no transform')
        return Estimate(T_target_source)
