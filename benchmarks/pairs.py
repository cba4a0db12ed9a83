# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether pairs of frames suffer from what is learned of the camera while they are registered.

    python benchmarks/pairs.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth or a kind of rendered camera, as for ``weights.py``. All
pairs of frames at gaps 1, 5 and 10 are registered in one run, as by ``aick benchmark``: without an
odometry, so that no velocity is known. Then they are registered once more while nothing is
learned. Where the share within a centimetre is smaller with learning by more than a tenth of the
pairs, at any gap, the exit code is 1.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import NamedTuple
from unittest import mock

sys.path.append(str(Path(__file__).resolve().parent))
from one_thread import restart_in_one_thread  # noqa: E402: found there

if __name__ == '__main__':
    restart_in_one_thread()

import cv2  # noqa: E402: only now do the libraries read how many threads they may have
import numpy as np  # noqa: E402
from markdown_page import table  # noqa: E402
from weights import GAPS, frames_of  # noqa: E402

from aick_ros.evaluation.scores.frame_pairs import countable_pairs  # noqa: E402
from aick_ros.evaluation.scores.ground_truth import true_motion  # noqa: E402
from aick_ros.frames.rgbd import RgbdFrame  # noqa: E402
from aick_ros.geometry import se3  # noqa: E402
from aick_ros.geometry.trajectory import Trajectory  # noqa: E402
from aick_ros.registration.learned import Learned  # noqa: E402
from aick_ros.registration.registrar import Registrar  # noqa: E402

FRAMES = 60
SUCCESS = 0.01  # m
MOST_LOST = 0.1  # share of the pairs; chosen: less is chance with so few


class Shares(NamedTuple):
    """
    Shares of the pairs within a centimetre, by gap.

    :param learning: while the registrar learns of the camera; ``without``: while it does not.
    """

    learning: dict[int, float]
    without: dict[int, float]

    @property
    def losses(self) -> list[str]:
        """Gaps at which learning costs more than it may, in words."""
        return [f'gap {gap}: {share:.2f} -> {self.learning[gap]:.2f}'
                for gap, share in self.without.items()
                if share - self.learning[gap] > MOST_LOST]

    def row(self, camera: str) -> tuple[str, ...]:
        """Return the row of a table."""
        return (camera, *(' / '.join(f'{share:.2f}' for share in shares.values())
                          for shares in self))


def successes(frames: list[RgbdFrame], truth: Trajectory) -> dict[int, float]:
    """Return the share of the pairs of each gap within a centimetre, all by one registrar."""
    registrar = Registrar()
    prepared = [registrar.prepare(frame) for frame in frames]
    stamps = [frame.stamp for frame in frames]
    pairs = {gap: countable_pairs(stamps, truth, gap) for gap in GAPS}
    found: dict[int, list[bool]] = {gap: [] for gap in GAPS}
    for target, source in sorted((pair for some in pairs.values() for pair in some),
                                 key=lambda pair: (pair.source, pair.target)):
        registration = registrar.register(prepared[source], prepared[target])
        true = true_motion(truth, stamps[target], stamps[source])
        error = se3.inverse(true) @ registration.T_target_source
        found[source - target].append(
            registration.status.ok and bool(np.linalg.norm(error[:3, 3]) < SUCCESS))
    return {gap: float(np.mean(some)) for gap, some in found.items() if some}


def shares_of(camera: str, count: int) -> Shares:
    """Return the shares of a camera, of its first frames."""
    frames, truth = frames_of(camera, count)
    nothing = mock.patch.object(Learned, '_learn', lambda *_: None)
    found = []
    for learning in nullcontext(), nothing:
        with learning:
            found.append(successes(frames, truth))
    return Shares(*found)


def main() -> None:
    """Print a table, a row per camera."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('cameras', nargs='+', metavar='CAMERA')
    parser.add_argument('--frames', type=int, default=FRAMES, help='of each camera')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    found = {camera: shares_of(camera, options.frames) for camera in options.cameras}
    gaps = ' / '.join(map(str, GAPS))
    print(table([('camera', f'within 10 mm, gap {gaps}', 'while nothing is learned'),
                 *(shares.row(camera) for camera, shares in found.items())]))
    sys.exit('\n'.join(f'learning loses pairs of {camera} within 10 mm, {loss}'
                       for camera, shares in found.items() for loss in shares.losses) or None)


if __name__ == '__main__':
    main()
