# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Objects that move by themselves, remembered from frame to frame.

A poster that is carried into the view has most of the keypoints some frames later, and from then
on the images of two frames alone say that it is the scene. So what has moved before is remembered
by its places in a frame, and is left out at first when another frame is registered to that one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.refinement.tracks import Tracks

_MOST_FRAMES = 64  # chosen: a second of a fast camera
_REMEMBERED = NANOSECONDS  # chosen: time since objects have been seen to move [ns]


@dataclass(frozen=True, eq=False)
class Places:
    """
    Where one frame sees the scene and objects that move by themselves.

    :param scene: Nx3 [m].
    :param objects: Mx3 [m].
    """

    scene: np.ndarray
    objects: np.ndarray


@dataclass(frozen=True, eq=False)
class FoundObjects:
    """
    What a registration shows, or knows, of objects that move by themselves.

    :param source: places in the source.
    :param target: likewise, in the target.
    :param seen: stamp of the last frame in which they moved [ns].
    """

    source: Places
    target: Places
    seen: int

    @classmethod
    def of(cls, scene: Tracks, objects: Tracks, T_target_source: np.ndarray,
           seen: int) -> FoundObjects:
        """Return what tracks on the scene and on objects show."""
        return cls(Places(scene.points, objects.points), Places(
            *(seen_by_target(tracks, T_target_source) for tracks in (scene, objects))), seen)


def seen_by_target(tracks: Tracks, T_target_source: np.ndarray) -> np.ndarray:
    """Return where the target sees tracks, Kx3 [m]: without a depth of its own, by the pose."""
    by_pose = se3.transform(T_target_source, tracks.points)[:, 2]
    depths = np.where(np.isfinite(tracks.depths), tracks.depths, by_pose)
    places: np.ndarray = np.column_stack([tracks.rays, np.ones(len(tracks))]) * depths[:, None]
    return places


@dataclass(frozen=True, eq=False)
class Known:
    """Places in a frame, and the stamp of the last frame in which the objects moved [ns]."""

    places: Places
    seen: int


class KnownObjects:
    """Remembers the objects of the last frames."""

    def __init__(self) -> None:
        self._known: dict[int, Known] = {}  # by the stamps of the frames [ns]

    def of(self, stamp: int) -> Known | None:
        """Return what is known of the frame with a stamp [ns]; None: nothing moves in it."""
        return self._known.get(stamp)

    def note(self, source: int, target: int, found: FoundObjects | None) -> None:
        """Note what the registration of two frames shows, by their stamps [ns]."""
        now, known = max(source, target), self._known
        for stamp in (source, target):
            known.pop(stamp, None)
        if found is not None:
            known[target] = Known(found.target, found.seen)
            known[source] = Known(found.source, found.seen)
        self._known = dict(list(
            (stamp, each) for stamp, each in known.items()
            if 0 <= now - each.seen < _REMEMBERED)[-_MOST_FRAMES:])
