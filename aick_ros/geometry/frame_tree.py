# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The tree of coordinate frames that /tf_static and /tf describe."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import RESTART_AFTER

_SAMPLES_KEPT = 500  # of a moving link: five seconds at 100 Hz


class Found(NamedTuple):
    """
    A transform between two frames.

    :param T_target_source: 4x4.
    :param is_fixed: whether no link on the way moves.
    :param gap: how far the moment asked for lies outside of what is known of a moving link [ns].
    """

    T_target_source: np.ndarray
    is_fixed: bool = True
    gap: int = 0


@dataclass
class _Moving:
    parent: str
    stamps: deque[int] = field(default_factory=lambda: deque(maxlen=_SAMPLES_KEPT))
    poses: deque[np.ndarray] = field(default_factory=lambda: deque(maxlen=_SAMPLES_KEPT))

    def at(self, stamp: int) -> Found:
        after = bisect_left(self.stamps, stamp)
        if after == len(self.stamps):
            return Found(self.poses[-1], False, stamp - self.stamps[-1])
        if after == 0:
            return Found(self.poses[0], False, self.stamps[0] - stamp)
        start, end = self.stamps[after - 1], self.stamps[after]
        return Found(se3.interpolate(self.poses[after - 1], self.poses[after],
                                       (stamp - start) / (end - start)), False)


class FrameTree:
    """Links of frames, fixed ones and moving ones, and what follows of them."""

    def __init__(self) -> None:
        self._fixed: dict[str, tuple[str, np.ndarray]] = {}
        self._moving: dict[str, _Moving] = {}

    def fix(self, parent: str, child: str, T_parent_child: np.ndarray) -> None:
        """Set a fixed link, which replaces what was known of the child."""
        self._fixed[child] = parent, T_parent_child

    def move(self, parent: str, child: str, stamp: int, T_parent_child: np.ndarray) -> None:
        """Set where a moving link was at a stamp [ns]; a clock set back starts it anew."""
        link = self._moving.get(child)
        if (link is None or link.parent != parent
                or link.stamps[-1] - stamp > RESTART_AFTER):
            link = self._moving[child] = _Moving(parent)
        if not link.stamps or stamp > link.stamps[-1]:
            link.stamps.append(stamp)
            link.poses.append(T_parent_child)

    def forget_moving(self) -> None:
        """Forget all moving links."""
        self._moving.clear()

    def find(self, target: str, source: str, stamp: int) -> Found | None:
        """Return the transform between two frames at a stamp [ns], None where nothing is known."""
        targets, sources = self._chain(target, stamp), self._chain(source, stamp)
        for frame, above_target in targets.items():
            if frame in sources:
                above_source = sources[frame]
                return Found(
                    se3.inverse(above_target.T_target_source) @ above_source.T_target_source,
                    above_target.is_fixed and above_source.is_fixed,
                    max(above_target.gap, above_source.gap))
        return None

    def _chain(self, frame: str, stamp: int) -> dict[str, Found]:
        """Return the transforms from the frame to itself and its ancestors, nearest first."""
        chain, reached = {}, Found(np.eye(4))
        while frame not in chain:  # a loop of frames ends where it began
            chain[frame] = reached
            if frame in self._fixed:
                frame, link = self._fixed[frame][0], Found(self._fixed[frame][1])
            elif frame in self._moving:
                frame, link = self._moving[frame].parent, self._moving[frame].at(stamp)
            else:
                break
            reached = Found(link.T_target_source @ reached.T_target_source,
                            link.is_fixed and reached.is_fixed, max(link.gap, reached.gap))
        return chain
