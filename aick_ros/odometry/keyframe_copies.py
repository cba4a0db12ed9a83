# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Keyframes that show what others show already.

A camera that goes to and fro makes keyframes of the same few views for ever. What they measure is
in the graph, and stays there when they are dropped; to be found again, a view needs no more than
its witnesses. The older ones stay, because their poses are the more certain ones.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

import numpy as np

from aick_ros.odometry.keyframe_graph import KeyframeGraph
from aick_ros.odometry.keyframe_search import WITNESSES, KeyframeSearch, view_distances
from aick_ros.settings import OdometrySettings

_SAME_VIEW = 0.15
"""Distance of two views, in the mean square, below which one stands for the other.

By default it is 12 cm or 6 degrees. Chosen on a rendered camera that goes to and fro, three
rendered walks and two excerpts of real recordings: the errors are those of keeping all; with 0.25
they are up to a third larger on two of the walks.
"""

_MISSES = 2  # chosen: a single search may fail because something passes in front of the camera


class KeyframeCopies:
    """Finds keyframes whose view is that of others, and knows which ones searches have missed."""

    def __init__(self) -> None:
        self._misses: Counter[int] = Counter()

    def learn(self, search: KeyframeSearch, graph: KeyframeGraph,
              settings: OdometrySettings) -> None:
        """Learn from a search that is finished which keyframes still show what is there."""
        for found in search.found:
            self.forget(found)
        missed = search.missed
        if missed is not None and _is_same_view(graph, missed, search.key, settings):
            self._misses[missed] += 1

    def copy_among(self, keys: Collection[int], graph: KeyframeGraph,
                   settings: OdometrySettings) -> int | None:
        """
        Return a keyframe whose view enough others show, or None where there is none.

        They are older, unless searches have missed it: then what is there has changed since.

        :param keys: of those that may be dropped.
        """
        chosen = np.array([row for row, key in enumerate(graph.keys) if key in keys], np.intp)
        if not chosen.size:
            return None
        numbers, poses = np.array(graph.keys), graph.matrices
        outdated = np.array([self.is_outdated(key) for key in graph.keys])
        stands_for = ~outdated[:, None] & (
            (numbers[:, None] < numbers[chosen]) | outdated[chosen])
        squares = view_distances(poses, poses[chosen], settings) ** 2
        near = stands_for & (squares < _SAME_VIEW ** 2)
        near &= near.sum(0) >= WITNESSES
        others, places = np.nonzero(near)
        is_same = (_mean_squares(graph, others, chosen[places], squares[others, places], settings)
                   < _SAME_VIEW ** 2)
        counts = np.bincount(places[is_same], minlength=len(chosen))
        copies = numbers[chosen[counts >= WITNESSES]].tolist()
        return max(copies, key=lambda key: (self.is_outdated(key), key), default=None)

    def forget(self, key: int) -> None:
        """Forget that searches have missed a keyframe."""
        del self._misses[key]

    def is_outdated(self, key: int) -> bool:
        """Return whether searches have missed a keyframe: newer ones may stand for it."""
        return self._misses[key] >= _MISSES


def _is_same_view(graph: KeyframeGraph, first: int, second: int,
                  settings: OdometrySettings) -> bool:
    """Return whether two views are the same in the mean square."""
    rows = np.array([[graph.keys.index(key)] for key in (first, second)])
    poses = graph.matrices[rows]
    squares = view_distances(poses[0], poses[1], settings)[0] ** 2
    mean_squares = _mean_squares(graph, rows[0], rows[1], squares, settings)
    return bool(mean_squares[0] < _SAME_VIEW ** 2)


def _mean_squares(graph: KeyframeGraph, first: np.ndarray, second: np.ndarray,
                  squares: np.ndarray, settings: OdometrySettings) -> np.ndarray:
    """
    Return the mean squared distances of views, by estimate and covariance, K.

    :param first: K rows of keyframes of the graph; ``second``: K others.
    :param squares: of the estimated distances, K.
    """
    if not len(first):
        return squares
    scales = np.array([settings.reuse_distance, settings.reuse_angle])
    mean_squares: np.ndarray = squares + (
        graph.relative_variances(first, second) / scales ** 2).sum(1)
    return mean_squares
