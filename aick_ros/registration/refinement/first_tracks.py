# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracks from a first pose, made once: what checks ask of the same pair begins there too."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.tracks import Tracks


class FirstTracks:
    """
    Remembers where the keypoints of the last source were found.

    Frames are known by themselves, not by their stamps, which two cameras may share; poses by
    their numbers. Whoever has one can be pickled; the copy remembers nothing.

    :param most: keypoints that are tracked, the first ones.
    """

    def __init__(self, tracker: Tracker, most: int) -> None:
        self._tracker, self._most = tracker, most
        self._source: weakref.ref[PreparedFrame] | None = None
        self._known: dict[tuple[weakref.ref[PreparedFrame], bytes], Tracks] = {}
        """Tracks of that source, by the target and the pose that they were sought from."""

    def of(self, source: PreparedFrame, target: PreparedFrame,
           T_target_source: np.ndarray) -> Tracks:
        """Find the keypoints of the source in the target, as the tracker does."""
        tracks = self._tracker.track(source, target, T_target_source)
        if not self._is_last(source):
            self._source, self._known = weakref.ref(source), {}
        self._known[weakref.ref(target), T_target_source.tobytes()] = tracks
        return tracks

    def of_some(self, source: PreparedFrame, target: PreparedFrame, T_target_source: np.ndarray,
                chosen: np.ndarray) -> Tracks | None:
        """
        Return the tracks of some keypoints, if all were tracked from the same pose; None if not.

        :param chosen: their rows, ascending; the tracks are numbered by their order.
        """
        if len(source.keypoints) > self._most or not self._is_last(source):
            return None
        known = self._known.get((weakref.ref(target), T_target_source.tobytes()))
        if known is None:
            return None
        tracks = known[np.isin(known.keypoints, chosen)]
        return replace(tracks, keypoints=np.searchsorted(chosen, tracks.keypoints))

    def _is_last(self, source: PreparedFrame) -> bool:
        return self._source is not None and self._source() is source

    def __getstate__(self) -> tuple[Tracker, int]:
        """Return what a copy has."""
        return self._tracker, self._most

    def __setstate__(self, state: tuple[Tracker, int]) -> None:
        """Become a copy."""
        FirstTracks.__init__(self, *state)
