# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Objects that move by themselves, remembered from frame to frame.

A poster that is carried into the view has most of the keypoints some frames later, and from then
on the images of two frames alone say that it is the scene. So what has moved before is remembered
by its places in a frame, and is excluded at first when another frame is registered to that one.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.found_objects import FoundObjects, Places

_MOST_FRAMES = 64  # chosen: a second of a fast camera
_REMEMBERED = NANOSECONDS  # chosen: time since objects have been seen to move [ns]


class KnownObjects:
    """Remembers the objects of the last frames."""

    def __init__(self) -> None:
        self._known: dict[int, Places] = {}  # by the stamps of the frames [ns]

    def of(self, stamp: int, now: int | None = None) -> Places | None:
        """
        Return what is known of the frame with a stamp [ns]; None: nothing moves in it.

        :param now: stamp of the frame that it is asked for, by which it may be forgotten.
        """
        known = self._known.get(stamp)
        return known if known is None or now is None or _is_recent(known, now) else None

    def note(self, source: int, target: int, found: FoundObjects | None) -> None:
        """Note what the registration of two frames shows, by their stamps [ns]."""
        known = self._known
        for stamp in (source, target):
            known.pop(stamp, None)
        if found is not None:
            known[target] = found.target
            known[source] = found.source
        self._forget(max(source, target))

    def note_intruders(self, stamp: int, scene: np.ndarray, objects: np.ndarray) -> None:
        """
        Note what has moved into the view of a frame, beside what it is known to show.

        :param stamp: of the frame [ns].
        :param scene: places in it, Nx3 [m]; ``objects``: likewise.
        """
        known = self._known.get(stamp)
        if known is not None:
            scene, objects = known.scene, np.vstack([known.objects, objects])
        self._known[stamp] = Places(scene, objects, stamp)
        self._forget(stamp)

    def _forget(self, now: int) -> None:
        """Forget what has not moved for long before a stamp [ns]."""
        self._known = dict(list(
            (stamp, each) for stamp, each in self._known.items()
            if now >= each.seen and _is_recent(each, now))[-_MOST_FRAMES:])


def _is_recent(places: Places, now: int) -> bool:
    """Return whether objects have moved shortly before a stamp [ns]."""
    return now - places.seen < _REMEMBERED
