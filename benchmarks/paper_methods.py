# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measures AICK with SURF and with a vocabulary beside what the paper has of them.

    AICK_DATA=FOLDER python benchmarks/paper_methods.py

FOLDER has the TUM excerpts freiburg1_xyz_150 and freiburg1_rpy_100; without it they are left out.
Rendered rooms come after them. No vocabulary of ours has seen any of these. Success is the share
of consecutive frames registered to within 0.01 m. Registrations of all methods are timed in turn,
pair by pair, in one thread, so that a machine's bad moment hits all of them: judge by the ratios.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

from one_thread import restart_in_one_thread

if __name__ == '__main__':
    restart_in_one_thread()

import cv2  # noqa: E402: only now do the libraries read how many threads they may have
import numpy as np  # noqa: E402

from aick_ros.evaluation.scores.ground_truth import true_pose  # noqa: E402
from aick_ros.evaluation.scores.machine import machine_facts  # noqa: E402
from aick_ros.features import make_detector  # noqa: E402
from aick_ros.features.haar import describe  # noqa: E402
from aick_ros.features.hessian import SCALE_OF_SIZE, find_blobs  # noqa: E402
from aick_ros.features.vocabulary import vocabulary_of  # noqa: E402
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame  # noqa: E402
from aick_ros.frames.rgbd import RgbdFrame  # noqa: E402
from aick_ros.geometry import se3  # noqa: E402
from aick_ros.registration.aick.aick import Aick  # noqa: E402
from aick_ros.settings import Settings  # noqa: E402
from aick_ros.settings.parameter import with_values  # noqa: E402
from aick_ros.settings.presets import preset  # noqa: E402
from aick_ros.sources import RgbdSource, open_source, raise_damage  # noqa: E402
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource  # noqa: E402

EXCERPTS = ('freiburg1_xyz_150', 'freiburg1_rpy_100')
ROOMS, FRAMES_A_ROOM = range(2000, 2010), 16
METHODS = {'aick-orb': 'paper-full', 'aick-surf': 'paper-full-surf', 'aick-orb-350': 'paper-fast',
           'aick-surf-200': 'paper-fast-surf', 'aick-orb-fast': 'paper-fast-words',
           'aick-surf-fast': 'paper-fast-surf-words'}
BASELINES = {'aick-surf': 'aick-orb', 'aick-orb-fast': 'aick-orb-350',
             'aick-surf-fast': 'aick-surf-200'}
PAPER_MS = {'aick-orb': 135.0, 'aick-surf': 180.0, 'aick-orb-350': 11.3, 'aick-surf-200': 3.85,
            'aick-orb-fast': 0.717, 'aick-surf-fast': 0.445}
RADII = {'aick-orb-fast': (0.165, 0.2, 0.22, 0.24, 0.26, 0.28, 0.31, 0.35),
         'aick-surf-fast': (0.14, 0.18, 0.22, 0.26, 0.3, 0.4)}
SUCCESS = 0.01  # m
LATE = 20_000_000  # ns off the median interval: such pairs are no neighbours
FRAMES_TIMED = 30


Recorded = tuple[list[RgbdFrame], list[np.ndarray | None]]
"""Frames, and where each was taken."""


def recordings() -> Iterator[tuple[str, Recorded]]:
    """Yield the real recordings at hand and the rendered rooms, which count as one recording."""
    for name in EXCERPTS:
        folder = Path(os.environ.get('AICK_DATA', ''), name)
        if 'AICK_DATA' in os.environ and folder.is_dir():
            yield name, recorded(open_source(folder))
    rooms = [recorded(SyntheticSource(SyntheticOptions(seed, FRAMES_A_ROOM))) for seed in ROOMS]
    # stamps go back from one room to the next: their frames are no neighbours
    yield f'{len(rooms)} rendered rooms', tuple(sum(parts, []) for parts in zip(*rooms))


def recorded(source: RgbdSource) -> Recorded:
    """Return all frames of a source."""
    frames = list(source.frames(raise_damage))
    return frames, [true_pose(source.ground_truth, frame.stamp) for frame in frames]


def keypoints_of(frames: list[RgbdFrame], settings: Settings) -> list[KeypointFrame]:
    """Return the keypoints of each frame, with their words."""
    extractor = KeypointExtractor(settings.features, settings.sensor, vocabulary_of(settings),
                                  settings.aick.word_radius)
    return [extractor.extract(frame) for frame in frames]


def compare(keypoints: dict[str, list[KeypointFrame]], settings: dict[str, Settings],
            truth: list[np.ndarray | None]) -> dict[str, tuple[float, float]]:
    """Return success ratio and median milliseconds of each method, on the same pairs in turn."""
    aicks = {method: Aick(chosen.aick) for method, chosen in settings.items()}
    errors: dict[str, list[float]] = {method: [] for method in keypoints}
    times: dict[str, list[float]] = {method: [] for method in keypoints}
    stamps = [frame.stamp for frame in next(iter(keypoints.values()))]
    intervals = np.diff(stamps)
    # frames are missing before these
    late = set(1 + np.flatnonzero(np.abs(intervals - np.median(intervals)) > LATE))
    for i in range(1, len(truth)):
        if truth[i] is None or truth[i - 1] is None or i in late:
            continue
        T_true = se3.inverse(truth[i - 1]) @ truth[i]
        for method, frames in keypoints.items():
            start = time.perf_counter()
            found = aicks[method].register(frames[i], frames[i - 1])
            times[method].append(1e3 * (time.perf_counter() - start))
            error = se3.inverse(T_true) @ found.T_target_source
            errors[method].append(
                float(np.linalg.norm(error[:3, 3])) if found.status.ok else np.inf)
    return {method: (float(np.mean(np.array(errors[method]) < SUCCESS)),
                     float(np.median(times[method]))) for method in keypoints}


def print_methods(frames: list[RgbdFrame], truth: list[np.ndarray | None]) -> None:
    """Print each method beside its baseline."""
    settings = {method: preset(name) for method, name in METHODS.items()}
    keypoints = {method: keypoints_of(frames, chosen) for method, chosen in settings.items()}
    scores = compare(keypoints, settings, truth)
    print('\n| method | keypoints | success | less its baseline | ms | baseline / it | the '
          "paper's ms |\n|---|---|---|---|---|---|---|")
    for method, (success, milliseconds) in scores.items():
        beside = ('', '')
        if method in BASELINES:
            base, base_ms = scores[BASELINES[method]]
            beside = f'{success - base:+.3f}', f'{base_ms / milliseconds:.2f}'
        count = np.mean([len(frame) for frame in keypoints[method]])
        print(f'| {method} | {count:.0f} | {success:.3f} | {beside[0]} | {milliseconds:.2f} | '
              f'{beside[1]} | {PAPER_MS[method]:g} |', flush=True)


def print_radii(frames: list[RgbdFrame], truth: list[np.ndarray | None]) -> None:
    """Print what R_w gains and costs, beside the full search of the same keypoints."""
    print('\n| method | R_w | words a keypoint | pairs of all | success | less full | full / it '
          'in ms |\n|---|---|---|---|---|---|---|')
    for method, radii in RADII.items():
        base = preset(METHODS[method])
        settings = {'full': with_values(base, {'aick.vocabulary': ''}),
                    **{f'{radius:g}': with_values(base, {'aick.word_radius': radius})
                       for radius in radii}}
        keypoints = {name: keypoints_of(frames, chosen) for name, chosen in settings.items()}
        scores = compare(keypoints, settings, truth)
        for name in list(settings)[1:]:
            of = keypoints[name]
            words = np.mean([len(frame.words.keypoints) / max(len(frame), 1) for frame in of])
            pairs = np.mean([len(a.words.pairs(b.words)[0]) / max(len(a) * len(b), 1)
                             for a, b in zip(of[1:], of)])
            print(f'| {method} | {name} | {words:.1f} | {pairs:.1%} | '
                  f'{scores[name][0]:.3f} | {scores[name][0] - scores["full"][0]:+.3f} | '
                  f'{scores["full"][1] / scores[name][1]:.2f} |', flush=True)


def print_surf(frames: list[RgbdFrame]) -> None:
    """Print where the time of SURF goes, beside ORB on the same images."""
    settings = preset('paper-full-surf').features
    surf, orb = settings.surf, make_detector(preset('paper-full').features)
    times, counts = [], []
    for grey in (frame.grey for frame in frames):
        clock = [time.perf_counter()]
        blobs = find_blobs(grey, surf.octaves, surf.intervals, surf.init_sample, surf.threshold)
        clock.append(time.perf_counter())
        describe(grey, blobs.pixels, SCALE_OF_SIZE * blobs.sizes)
        clock.append(time.perf_counter())
        orb.detect(grey)
        clock.append(time.perf_counter())
        times.append(np.diff(clock))
        counts.append(len(blobs.sizes))
    blobs_ms, describe_ms, orb_ms = 1e3 * np.median(times, axis=0)
    print(f'\nSURF, {np.mean(counts):.0f} keypoints: {blobs_ms:.1f} ms to find and '
          f'{describe_ms:.1f} ms to describe; ORB {orb_ms:.1f} ms; SURF / ORB '
          f'{(blobs_ms + describe_ms) / orb_ms:.1f}')


def main() -> None:
    """Print the tables."""
    cv2.setNumThreads(1)
    print(', '.join(f'{name} {value}' for name, value in machine_facts().items()))
    for name, (frames, truth) in recordings():
        print(f'\n## {name}, {len(frames)} frames')
        print_surf(frames[:FRAMES_TIMED])
        print_methods(frames, truth)
        print_radii(frames, truth)


if __name__ == '__main__':
    main()
