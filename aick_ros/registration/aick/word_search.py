# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints among those that share a word (III-B)."""

from __future__ import annotations

import numpy as np

from aick_ros.features.descriptors import pair_distances
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.registration.aick.candidates import Candidates
from aick_ros.registration.aick.search import Search
from aick_ros.settings import AickSettings


class WordSearch(Search):
    """
    Compares a source keypoint with the target keypoints that have its closest word in Psi.

    Nothing is as large as the number of all pairs.

    :param source: keypoints with words; target: likewise, of the same vocabulary.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source, target, settings)
        rows = source.words.pairs(target.words)
        d_d = pair_distances(source.descriptors, target.descriptors, *rows)
        self._pairs = Candidates(rows, d_d, self._target)

    def _alike(self, bound: float) -> Candidates:
        return self._pairs.where(self._pairs.distances < bound)

    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        return self._pairs.where(self._pairs.squared_distances(moved) < radius ** 2)
