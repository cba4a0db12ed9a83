# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Vocabularies of several sizes for the figure that compares them, from rendered rooms."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from aick_ros.features.k_means import learn_words
from aick_ros.features.vocabulary import Vocabulary
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings.presets import preset
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SIZES = (10, 30, 100, 300, 1000, 5000)
"""Numbers of words. By definition: the paper has 10 to 5,000."""

DETECTORS = {'orb': 'paper-full', 'surf': 'paper-full-surf'}
"""Detector -> preset of its keypoints."""

ROOMS = range(1000, 1012)
"""Seeds of the rooms. Chosen: other rooms than those of the tests."""

_FRAMES_PER_ROOM, _RATE = 5, 0.7  # [-, Hz]; consecutive frames are similar; chosen
_ROUNDS = 5  # of the clustering; more make no difference with few descriptors per word; chosen

Wanted = tuple[str, int]
"""A detector and a number of words."""

TRAINING_FRAMES = len(ROOMS) * _FRAMES_PER_ROOM


def file_name(wanted: Wanted) -> str:
    """Return the file name of a vocabulary."""
    detector, size = wanted
    return f'{detector}-{size}.npz'


def missing_from(folder: Path) -> list[Wanted]:
    """Return the vocabularies that are missing in a folder."""
    every = ((detector, size) for detector in DETECTORS for size in SIZES)
    return [wanted for wanted in every if not (folder / file_name(wanted)).is_file()]


def training_frames() -> Iterator[RgbdFrame]:
    """Yield the frames to learn from."""
    for seed in ROOMS:
        room = SyntheticSource(SyntheticOptions(seed, _FRAMES_PER_ROOM, _RATE))
        for index in range(_FRAMES_PER_ROOM):
            yield room.frame(index)


def learn(wanted: Sequence[Wanted], frames: Iterator[RgbdFrame],
          on_progress: Callable[[int], None]) -> Iterator[tuple[Wanted, Vocabulary]]:
    """
    Yield each vocabulary when it is learned.

    :param frames: frames to learn from; all keypoints with depth are used.
    :param on_progress: called with the number of frames, then frames and vocabularies, done.
    """
    extractors = {detector: _extractor(detector) for detector, _ in wanted}
    found: dict[str, list[np.ndarray]] = {detector: [] for detector in extractors}
    done = 0
    for frame in frames:
        for detector, extractor in extractors.items():
            found[detector].append(extractor.extract(frame).descriptors)
        done += 1
        on_progress(done)
    for detector, size in wanted:
        words = learn_words(np.concatenate(found[detector]), size, rounds=_ROUNDS)
        done += 1
        on_progress(done)
        yield (detector, size), Vocabulary(detector, words, f'{len(ROOMS)} rendered rooms')


def _extractor(detector: str) -> KeypointExtractor:
    settings = preset(DETECTORS[detector])
    return KeypointExtractor(settings.features, settings.sensor)
