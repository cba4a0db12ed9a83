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
        poses = graph.matrices
        near = view_distances(poses, poses, settings) < _SAME_VIEW
        rows = dict(zip(graph.keys, near))
        for key in sorted(keys, key=lambda key: (self._is_outdated(key), key), reverse=True):
            others = [other for other, is_near in zip(graph.keys, rows[key])
                      if is_near and self._stands_for(other, key)]
            if len(others) >= WITNESSES and WITNESSES <= sum(
                    _is_same_view(graph, other, key, settings) for other in others):
                return key
        return None

    def forget(self, key: int) -> None:
        """Forget that searches have missed a keyframe."""
        del self._misses[key]

    def _stands_for(self, other: int, key: int) -> bool:
        return (other != key and not self._is_outdated(other)
                and (other < key or self._is_outdated(key)))

    def _is_outdated(self, key: int) -> bool:
        return self._misses[key] >= _MISSES


def _is_same_view(graph: KeyframeGraph, first: int, second: int,
                  settings: OdometrySettings) -> bool:
    """Return whether two views are the same in the mean square, by estimate and covariance."""
    relative = graph.relative(first, second)
    apart = view_distances(relative.matrix[None], np.eye(4)[None], settings)[0, 0]
    variances = np.diag(relative.covariance)
    mean_square = (apart ** 2 + variances[:3].sum() / settings.reuse_distance ** 2
                   + variances[3:].sum() / settings.reuse_angle ** 2)
    return bool(mean_square < _SAME_VIEW ** 2)
