# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracks from a first pose, made once: what checks ask of the same pair begins there too."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.tracks import Tracks


@dataclass(frozen=True, eq=False)
class _Known:
    """Tracks of a source, by the target and the very pose that they were sought from."""

    target: PreparedFrame
    T_target_source: np.ndarray
    tracks: Tracks


class FirstTracks:
    """
    Remembers where the keypoints of the last source were found.

    :param most: keypoints that are tracked, the first ones.
    """

    def __init__(self, tracker: Tracker, most: int) -> None:
        self._tracker, self._most = tracker, most
        self._known = LastResults(_none_known, 1)

    def of(self, source: PreparedFrame, target: PreparedFrame,
           T_target_source: np.ndarray) -> Tracks:
        """Find the keypoints of the source in the target, as the tracker does."""
        tracks = self._tracker.track(source, target, T_target_source)
        self._known(source).append(_Known(target, T_target_source, tracks))
        return tracks

    def of_some(self, source: PreparedFrame, target: PreparedFrame, T_target_source: np.ndarray,
                chosen: np.ndarray) -> Tracks | None:
        """
        Return the tracks of some keypoints, if all were tracked from the same pose; None if not.

        :param chosen: their rows, ascending; the tracks are numbered by their order.
        """
        if len(source.keypoints) > self._most:
            return None
        for known in self._known(source):
            if known.target is target and known.T_target_source is T_target_source:
                tracks = known.tracks[np.isin(known.tracks.keypoints, chosen)]
                return replace(tracks, keypoints=np.searchsorted(chosen, tracks.keypoints))
        return None


def _none_known(source: PreparedFrame) -> list[_Known]:
    return []
