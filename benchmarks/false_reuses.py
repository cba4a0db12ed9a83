# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How often a place that only looks alike is taken for a keyframe.

    python benchmarks/false_reuses.py [--rooms N] [--first SEED] [--rate HZ] [--seconds S]

In each room one piece of furniture is repeated along a wall every 0.4 to 0.75 m, and a camera
(160x120) is moved along it to and fro. The odometry follows it; then its frames are sought among
each other as if the odometry had drifted, by errors drawn with up to the largest standard
deviation at which it still searches. A reuse is off if its error is above 5 cm or 3 degrees, and
false if that is also outside of the 99.7 % ellipsoid of its covariance. Where an increment is off
or a reuse is false the exit code is 1.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))
from one_thread import restart_in_one_thread  # noqa: E402: found there

if __name__ == '__main__':
    restart_in_one_thread()

import cv2  # noqa: E402: only now do the libraries read how many threads they may have
import numpy as np  # noqa: E402
from found_again import Reuse, followed, is_false  # noqa: E402
from lookalike import PIECES, Returning, lookalike_room  # noqa: E402
from markdown_page import table  # noqa: E402

from aick_ros.evaluation.scores.frame_record import FrameRecord  # noqa: E402
from aick_ros.evaluation.scores.increment_error import IncrementError  # noqa: E402
from aick_ros.evaluation.scores.run_errors import RunErrors  # noqa: E402
from aick_ros.frames.prepared import PreparedFrame  # noqa: E402
from aick_ros.geometry import se3  # noqa: E402
from aick_ros.geometry.camera import Camera  # noqa: E402
from aick_ros.geometry.pose import PoseWithCovariance  # noqa: E402
from aick_ros.geometry.stamps import NANOSECONDS  # noqa: E402
from aick_ros.geometry.trajectory import Trajectory  # noqa: E402
from aick_ros.odometry import keyframe_search  # noqa: E402
from aick_ros.odometry.keyframe_graph import KeyframeGraph  # noqa: E402
from aick_ros.odometry.keyframe_search import KeyframeSearch, candidates  # noqa: E402
from aick_ros.registration.registrar import Registrar  # noqa: E402
from aick_ros.settings import Settings  # noqa: E402
from aick_ros.sources import raise_damage  # noqa: E402
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource  # noqa: E402

CAMERA = Camera(160, 120, 131.25, 131.25, 79.5, 59.5)
REACH, TURN = 0.5, 25.0  # of the camera: about one piece of furniture to either side [m], [deg]
TRIALS = 12  # frames that are sought, per room
KEPT = 5  # one of so many frames is a keyframe that may be found
PRECISE = np.diag(np.repeat([1e-6, 1e-6], 3))  # of keyframes to each other: 1 mm, 0.06 deg
TURN_PER_METRE = 0.3  # drift of the orientation by that of the position [rad/m]


@dataclass
class Tally:
    """Keyframes found again in rooms of one kind."""

    rooms: int = 0
    slips: int = 0  # increments that were reported as good, but off
    searches: int = 0
    walk: list[IncrementError] = field(default_factory=list)
    drift: list[IncrementError] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Add other rooms."""
        self.rooms, self.slips = self.rooms + other.rooms, self.slips + other.slips
        self.searches += other.searches
        self.walk, self.drift = self.walk + other.walk, self.drift + other.drift

    @property
    def mistakes(self) -> str:
        """Number of places mistaken for others, in words; '' where there are none."""
        false = sum(map(is_false, (*self.walk, *self.drift)))
        return (f'{self.slips} increments are off and {false} reuses are false in {self.rooms} '
                'rooms, and none may be: the lines of the rooms say in which'
                if self.slips or false else '')

    def row(self, name: str) -> tuple[str, ...]:
        """Return the row of a table."""
        return (name, str(self.rooms), str(self.slips), *_counts(self.walk), str(self.searches),
                *_counts(self.drift))


def _counts(errors: list[IncrementError]) -> tuple[str, ...]:
    largest = max((error.translation for error in errors), default=0.0)
    return (str(len(errors)), str(sum(error.is_wrong for error in errors)),
            str(sum(map(is_false, errors))), f'{1e3 * largest:.0f}')


def walked(seed: int, rate: float, frames: int) -> Tally:
    """Return what was found again in the room of a seed."""
    scene = lookalike_room(seed)
    path = Returning(np.random.default_rng([seed, 1]), scene.free, REACH, TURN)
    source = SyntheticSource(
        SyntheticOptions(seed=seed, frames=frames, rate=rate, camera=CAMERA), scene, path)
    updates, reuses = followed(source.frames(raise_damage))
    prepared = dict(enumerate(update.prepared for update in updates))
    rng = np.random.default_rng([seed, 4])
    searches = [_sought(rng, prepared, source.ground_truth) for _ in range(TRIALS)]
    increments = RunErrors.of([FrameRecord.of(update) for update in updates],
                              source.ground_truth).accepted
    return Tally(1, sum(error.is_wrong for error in increments),
                 sum(found is not None for found in searches),
                 _errors(reuses, source.ground_truth),
                 _errors([reuse for found in searches for reuse in found or ()],
                         source.ground_truth))


def _errors(reuses: list[Reuse], truth: Trajectory) -> list[IncrementError]:
    return [error for reuse in reuses if (error := reuse.error(truth)) is not None]


def _sought(rng: np.random.Generator, frames: dict[int, PreparedFrame],
            truth: Trajectory) -> list[Reuse] | None:
    """Return the reuses of a search for a frame after a drift; None if it is not sought."""
    settings, registrar = Settings(), Registrar()
    new = int(rng.integers(KEPT, len(frames)))
    old = range(0, new - 1, KEPT)
    sigma = rng.uniform(0.2, 1.0) * keyframe_search.MAX_SIGMA / np.sqrt(3.0)
    drift = np.diag(np.repeat([sigma, TURN_PER_METRE * sigma], 3) ** 2)
    graph = KeyframeGraph(old[0], PoseWithCovariance(np.eye(4), PRECISE))
    for key, parent in zip((*old[1:], new), old):
        covariance = drift if key == new else PRECISE
        step = se3.inverse(truth.poses[parent]) @ truth.poses[key]
        error = rng.multivariate_normal(np.zeros(6), covariance)
        graph.add(key, PoseWithCovariance(se3.perturbed(step, error), covariance), parent)
    # old enough to be sought
    stamps = {key: frames[key].stamp + (10 * NANOSECONDS if key == new else 0)
              for key in (*old, new)}
    chosen = candidates(graph, new, stamps, settings.odometry)
    if not chosen:
        return None
    search = KeyframeSearch(new, chosen)
    while not search.is_finished:
        accepted = search.step(graph, frames, registrar, settings)
    return [Reuse(frames[m.first].stamp, frames[m.second].stamp, m.pose) for m in accepted]


def main() -> None:
    """Print a table, a row per piece of furniture."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rooms', type=int, default=100)
    parser.add_argument('--first', type=int, default=1000, help='seed of the first room')
    parser.add_argument('--rate', type=float, default=8.0, help='of the frames [Hz]')
    parser.add_argument('--seconds', type=float, default=6.0, help='of each walk')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    kinds = {name: Tally() for name in PIECES}
    for seed in range(options.first, options.first + options.rooms):
        name = list(PIECES)[seed % len(PIECES)]
        tally = walked(seed, options.rate, round(options.seconds * options.rate))
        kinds[name].add(tally)
        print('  '.join((f'room {seed}', *tally.row(name))), file=sys.stderr, flush=True)
    total = Tally()
    for tally in kinds.values():
        total.add(tally)
    counts = ('reuses', 'off', 'false', 'largest error [mm]')
    print(table([('repeated', 'rooms', 'increments off', *counts, 'sought after a drift', *counts),
                 *(tally.row(name) for name, tally in {**kinds, 'all': total}.items())]))
    sys.exit(total.mistakes or None)


if __name__ == '__main__':
    main()
