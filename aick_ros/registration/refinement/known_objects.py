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

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.refinement.object_places import seen_by_target
from aick_ros.registration.refinement.tracks import Tracks

_MOST_FRAMES = 64  # chosen: a second of a fast camera
_REMEMBERED = NANOSECONDS  # chosen: time since objects have been seen to move [ns]


@dataclass(frozen=True, eq=False)
class Places:
    """
    Where one frame sees the scene and objects that move by themselves.

    :param scene: Nx3 [m].
    :param objects: Mx3 [m].
    :param seen: stamp of the last frame in which the objects moved [ns].
    """

    scene: np.ndarray
    objects: np.ndarray
    seen: int


@dataclass(frozen=True, eq=False)
class FoundObjects:
    """
    What a registration shows, or knows, of objects that move by themselves.

    :param source: places in the source.
    :param target: likewise, in the target.
    """

    source: Places
    target: Places

    @classmethod
    def of(cls, scene: Tracks, objects: Tracks, T_target_source: np.ndarray,
           seen: int) -> FoundObjects:
        """Return what tracks on the scene and on objects show; seen: as of :class:`Places`."""
        return cls(Places(scene.points, objects.points, seen),
                   Places(seen_by_target(scene, T_target_source),
                          seen_by_target(objects, T_target_source), seen))


class KnownObjects:
    """Remembers the objects of the last frames."""

    def __init__(self) -> None:
        self._known: dict[int, Places] = {}  # by the stamps of the frames [ns]

    def of(self, stamp: int) -> Places | None:
        """Return what is known of the frame with a stamp [ns]; None: nothing moves in it."""
        return self._known.get(stamp)

    def note(self, source: int, target: int, found: FoundObjects | None) -> None:
        """Note what the registration of two frames shows, by their stamps [ns]."""
        now, known = max(source, target), self._known
        for stamp in (source, target):
            known.pop(stamp, None)
        if found is not None:
            known[target] = found.target
            known[source] = found.source
        self._known = dict(list(
            (stamp, each) for stamp, each in known.items()
            if 0 <= now - each.seen < _REMEMBERED)[-_MOST_FRAMES:])
