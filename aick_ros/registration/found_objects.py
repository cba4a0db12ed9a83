# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Objects that move by themselves, as one registration shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.registration.tracks import Tracks


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

    @property
    def count(self) -> int:
        """Number of tracks on objects."""
        return len(self.source.objects)

    @classmethod
    def of(cls, scene: Tracks, objects: Tracks, T_target_source: np.ndarray,
           seen: int) -> FoundObjects:
        """Return what tracks on the scene and on objects show; seen: as of :class:`Places`."""
        return cls(Places(scene.points, objects.points, seen),
                   Places(scene.seen_by_target(T_target_source),
                          objects.seen_by_target(T_target_source), seen))
