# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints among those that share a visual word (III-B)."""

from __future__ import annotations

import numpy as np

from aick_ros.features.descriptors import pair_distances
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.registration.aick.candidates import Candidates
from aick_ros.registration.aick.search import Search
from aick_ros.settings import AickSettings


class WordSearch(Search):
    """
    Compares a source keypoint with the target keypoints whose Psi contains its closest word.

    Memory and time grow with the number of these pairs, not with that of all pairs.

    :param source: keypoints with words.
    :param target: keypoints with words of the same vocabulary.
    :raises ValueError: if a frame has no words.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source, target, settings)
        if source.words is None or target.words is None:
            raise ValueError('a search by words requires the words of both frames')
        rows = source.words.pairs(target.words)
        self._pairs = Candidates(
            rows, pair_distances(source.descriptors, target.descriptors, *rows))

    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        return self._pairs
