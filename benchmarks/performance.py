# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measures accuracy and speed, and prints them beside what they must be.

    AICK_DATA=FOLDER python benchmarks/performance.py

FOLDER has the TUM excerpts freiburg1_xyz_150 and freiburg1_rpy_100. Without it the rows of real
cameras are omitted and rendered images are used for speed. Each row names the command that
gives the same figure. Registrations are timed in this process, one after the other, in one
thread: BLAS is held to it by OPENBLAS_NUM_THREADS=1 and OMP_NUM_THREADS=1, with which this script
restarts itself, OpenCV by setNumThreads(1).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from one_thread import restart_in_one_thread

if __name__ == '__main__':
    restart_in_one_thread()

import cv2  # noqa: E402: only now do the libraries read how many threads they may have
import numpy as np  # noqa: E402
from naive_aick import register as register_naively  # noqa: E402
from row import HEAD, Row  # noqa: E402

from aick_ros.evaluation.scores.machine import machine_facts  # noqa: E402
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame  # noqa: E402
from aick_ros.geometry import se3  # noqa: E402
from aick_ros.registration.aick.aick import Aick  # noqa: E402
from aick_ros.settings.presets import preset  # noqa: E402
from aick_ros.sources import RgbdSource, open_source, raise_damage  # noqa: E402
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource  # noqa: E402
from aick_ros.sources.writers.bag_writer import write_bag  # noqa: E402

XYZ, RPY = 'freiburg1_xyz_150', 'freiburg1_rpy_100'
ALL_KEYPOINTS = ('--set', 'refinement.mode=none', '--set', 'aick.alpha=0.6',
                 '--set', 'aick.iterations=10', '--set', 'features.max_keypoints=0')
PAIRS_TIMED = 60
NAIVE_PAIRS_TIMED = 15


def accuracy_on_real_cameras() -> Iterator[Row]:
    """Success ratios of the paper's full search on the excerpts of TUM sequences."""
    for name in (XYZ, RPY):
        if not data_folder(name):
            continue
        near, command = evaluate(f'$AICK_DATA/{name}', '--preset', 'paper-full', '--gaps', '1')
        ratios = near['pairs']['1']['success_ratio']
        yield Row(f'success at 0.01 m, gap 1, {name}', 0.84, True, ratios['0.01'], '', command)
        yield Row(f'success at 0.05 m, gap 1, {name}', 0.99, True, ratios['0.05'], '', command)
        far, command = evaluate(f'$AICK_DATA/{name}', *ALL_KEYPOINTS, '--gaps', '5')
        yield Row(f'success at 0.01 m, gap 5, {name}', 0.28, True,
                  far['pairs']['5']['success_ratio']['0.01'], '', command)


def accuracy_without_noise() -> Iterator[Row]:
    """Success ratio on perfect images with exact ground truth."""
    with tempfile.TemporaryDirectory() as folder:
        simulated = aick('simulate', f'{folder}/perfect', '--perfect')
        figures, command = evaluate(f'{folder}/perfect', '--preset', 'paper-full', '--gaps', '1')
        commands = f'{simulated[1]} && {command}'.replace(folder, '/tmp')
        yield Row('success at 0.0033 m, gap 1, rendered without noise', 0.95, True,
                  figures['pairs']['1']['success_ratio']['0.0033'], '', commands)


def registration_times() -> Iterator[Row]:
    """Medians of one registration in one thread, beside the straightforward one."""
    source = recording()
    for name, must in (('paper-fast', 3.0), ('paper-full', 50.0)):
        settings = preset(name)
        extractor = KeypointExtractor(settings.features, settings.sensor)
        frames = [extractor.extract(frame)
                  for _, frame in zip(range(PAIRS_TIMED + 1), source.frames(raise_damage))]
        ours = Aick(settings.aick)
        pairs = list(zip(frames[1:], frames))
        times, poses = timed(lambda a, b: ours.register(a, b).T_target_source, pairs)
        naive_times, naive_poses = timed(
            lambda a, b: register_naively(a, b, settings.aick), pairs[:NAIVE_PAIRS_TIMED])
        ratio = np.median(naive_times) / np.median(times[:NAIVE_PAIRS_TIMED])
        apart = max(float(np.abs(se3.inverse(a) @ b - np.eye(4)).max())
                    for a, b in zip(poses, naive_poses))
        keypoints = np.mean([len(frame) for frame in frames])
        yield Row(f'registration, {keypoints:.0f} keypoints, {settings.aick.iterations} '
                  f'iterations, one thread ({source.name})', must, False,
                  float(np.median(times)), 'ms', 'python benchmarks/performance.py',
                  f'{ratio:.1f} times as fast as all pairs in each iteration, poses within '
                  f'{apart:.0e}')


def replay_speed() -> Iterator[Row]:
    """Frames a second of a replay, from reading the bag to writing each line."""
    with tempfile.TemporaryDirectory() as folder:
        source = recording()
        source.ground_truth = None
        write_bag(Path(folder, 'bag'), source)
        summary, command = aick('replay', f'{folder}/bag', '--preset', 'paper-fast',
                                '--out', f'{folder}/runs', '--json', '-')
        yield Row(f'replay of a bag of {source.name}, 640x480', 60, True,
                  json.loads(summary)['frames_per_second'], 'frames/s',
                  command.replace(folder, '/tmp'))


def node_over_dds() -> Iterator[Row]:
    """The node in its own process, every frame of a raw 640x480 stream at 30 Hz, over DDS."""
    with tempfile.TemporaryDirectory() as folder:
        text, command = aick('demo', '--frames', '600', '--out', folder, '--json', '-')
        figures = json.loads(text)
        command = command.replace(folder, '/tmp')
        yield Row('frames lost by the node at 30 Hz, 640x480, every frame', 0, False,
                  figures['frames_played'] - figures['frames_answered'], '', command)
        yield Row('delay from image to odometry, median', 30, False,
                  figures['delay_ms']['p50'], 'ms', command,
                  f'99th percentile {figures["delay_ms"]["p99"]:.1f} ms')


MEASURES: Sequence[Callable[[], Iterator[Row]]] = (
    accuracy_on_real_cameras, accuracy_without_noise, registration_times, replay_speed,
    node_over_dds)
"""Measurements, in order; add a function that yields rows."""


def data_folder(name: str) -> Path | None:
    """Return the folder of a real recording, None where it is not at hand."""
    folder = Path(os.environ.get('AICK_DATA', ''), name)
    return folder if 'AICK_DATA' in os.environ and folder.is_dir() else None


def recording() -> RgbdSource:
    """Return a real recording, or a rendered one where none is at hand."""
    folder = data_folder(XYZ)
    return SyntheticSource(SyntheticOptions(seed=1)) if folder is None else open_source(folder)


def aick(*arguments: str) -> tuple[str, str]:
    """Run the command; return its standard output and the command line."""
    process = subprocess.run(
        [sys.executable, '-m', 'aick_ros', *(os.path.expandvars(word) for word in arguments)],
        stdout=subprocess.PIPE, text=True, check=True)
    return process.stdout, ' '.join(('aick', *arguments))


def evaluate(*arguments: str) -> tuple[dict, str]:
    """Run ``aick evaluate``; return its figures and the command line."""
    text, command = aick('evaluate', *arguments, '--json', '-')
    return json.loads(text), command


def timed(register: Callable[[KeypointFrame, KeypointFrame], np.ndarray],
          pairs: Sequence[tuple[KeypointFrame, KeypointFrame]],
          ) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the milliseconds of each registration and the poses found."""
    times, poses = [], []
    for source, target in pairs:
        start = time.perf_counter()
        poses.append(register(source, target))
        times.append(1e3 * (time.perf_counter() - start))
    return np.array(times), poses


def main() -> None:
    """Print the table."""
    cv2.setNumThreads(1)
    print(', '.join(f'{name} {value}' for name, value in machine_facts().items()))
    if not data_folder(XYZ):
        print('no real recordings: AICK_DATA names no folder with', XYZ)
    print(f'\n{HEAD}')
    for measure in MEASURES:
        for row in measure():
            print(row, flush=True)


if __name__ == '__main__':
    main()
