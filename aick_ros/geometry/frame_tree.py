# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tree of coordinate frames, made of the transforms of /tf_static and /tf."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from typing import NamedTuple

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

LARGEST_GAP = NANOSECONDS // 2
"""Largest time from a sample of a link to a stamp, or to the next sample [ns]; chosen."""

_HISTORY = 10 * NANOSECONDS  # of a dynamic link, as tf2 keeps by default
_MAX_SAMPLES = 20_000  # of a dynamic link: the whole history at 2 kHz
_MAX_LINKS = 10_000  # dynamic ones; chosen: some publishers name each object that they see anew
_REST_DISTANCE = 1e-3  # metres within which a dynamic link rests; chosen
_REST_ANGLE = math.radians(0.1)  # likewise; chosen: above a step of an encoder of 12 bits


class FrameTransform(NamedTuple):
    """
    A transform between two frames at a stamp.

    :param T_target_source: 4x4.
    :param is_static: whether all links between the frames are static.
    :param gap: time from the stamp to the nearest sample of a dynamic link that does not cover
        it [ns]; 0: all are static or interpolated.
    :param has_rested: whether each link whose last sample is before the stamp stayed within 1 mm
        and 0.1 deg for as long before that sample.
    :param is_past: whether the stamp is before the first sample of a dynamic link, or in a hole
        of its samples, so that no later sample will reach it.
    """

    T_target_source: np.ndarray
    is_static: bool = True
    gap: int = 0
    has_rested: bool = True
    is_past: bool = False

    def joined(self, other: FrameTransform, T_target_source: np.ndarray) -> FrameTransform:
        """Return the transform along the links of both."""
        return FrameTransform(
            T_target_source, self.is_static and other.is_static, max(self.gap, other.gap),
            self.has_rested and other.has_rested, self.is_past or other.is_past)


class _DynamicLink:
    """The last samples of a link that moves."""

    def __init__(self, parent: str) -> None:
        self.parent = parent
        self._stamps: deque[int] = deque(maxlen=_MAX_SAMPLES)
        self._poses: deque[np.ndarray] = deque(maxlen=_MAX_SAMPLES)
        self._rest = 0, np.eye(4)  # stamp and pose since which it rests

    def restarts_at(self, stamp: int) -> bool:
        return bool(self._stamps) and self._stamps[-1] - stamp > RESTART_AFTER

    def add(self, stamp: int, T_parent_child: np.ndarray) -> None:
        if self._stamps and stamp <= self._stamps[-1]:
            return
        if not (self._stamps and _is_near(self._rest[1], T_parent_child)):
            self._rest = stamp, T_parent_child
        self._stamps.append(stamp)
        self._poses.append(T_parent_child)
        # the first one kept may be older, so that a slow link covers the whole history too
        while len(self._stamps) > 1 and self._stamps[1] <= stamp - _HISTORY:
            self._stamps.popleft()
            self._poses.popleft()

    def at(self, stamp: int) -> FrameTransform:
        after = bisect_left(self._stamps, stamp)
        if after == len(self._stamps):
            last = self._stamps[-1]
            return FrameTransform(self._poses[-1], False, stamp - last,
                                  has_rested=stamp - last <= last - self._rest[0])
        if after == 0:
            gap = self._stamps[0] - stamp
            return FrameTransform(self._poses[0], False, gap,
                                  has_rested=gap == 0, is_past=gap > 0)
        return self._between(after - 1, after, stamp)

    def _between(self, before: int, after: int, stamp: int) -> FrameTransform:
        """Return the link between two samples: what it did in a hole is not known."""
        start, end = self._stamps[before], self._stamps[after]
        earlier, later = self._poses[before], self._poses[after]
        if end - start > LARGEST_GAP and stamp < end and not _is_near(earlier, later):
            gap = min(stamp - start, end - stamp)
            return FrameTransform(earlier if stamp - start == gap else later, False, gap,
                                  has_rested=False, is_past=True)
        return FrameTransform(
            se3.interpolate(earlier, later, (stamp - start) / (end - start)), False)


class FrameTree:
    """Static and dynamic links between frames, and the transforms along chains of them."""

    def __init__(self) -> None:
        self._static: dict[str, tuple[str, np.ndarray]] = {}
        self._dynamic: dict[str, _DynamicLink] = {}

    def set_static(self, parent: str, child: str, T_parent_child: np.ndarray) -> None:
        """Set a static link; it replaces any earlier one of the child."""
        self._static[child] = parent, T_parent_child

    def add_sample(self, parent: str, child: str, stamp: int, T_parent_child: np.ndarray) -> None:
        """
        Add a sample of a dynamic link.

        :param stamp: [ns]; one that is not newer than the last is ignored, one that goes back by
            more than ``RESTART_AFTER`` (a clock set back) clears the history of the link. Of too
            many links, the one that has had no sample for the longest is forgotten.
        """
        link = self._dynamic.pop(child, None)
        if link is None or link.parent != parent or link.restarts_at(stamp):
            link = _DynamicLink(parent)
        self._dynamic[child] = link  # behind those that have had none for longer
        link.add(stamp, T_parent_child)
        if len(self._dynamic) > _MAX_LINKS:
            del self._dynamic[next(iter(self._dynamic))]

    def has_link(self, parent: str, child: str) -> bool:
        """Return whether there is a link of these two, static or dynamic."""
        link = self._dynamic.get(child)
        return (child in self._static and self._static[child][0] == parent
                or link is not None and link.parent == parent)

    def clear_dynamic(self) -> None:
        """Forget all dynamic links."""
        self._dynamic.clear()

    def find(self, target: str, source: str, stamp: int) -> FrameTransform | None:
        """
        Return the transform between two frames at a stamp [ns], None if they are not connected.

        Dynamic links are interpolated. Outside of their history the nearest sample is taken, and
        in a hole: between samples that are more than ``LARGEST_GAP`` apart and differ.
        """
        targets, sources = self._chain(target, stamp), self._chain(source, stamp)
        for frame, ancestor_target in targets.items():
            if frame in sources:
                ancestor_source = sources[frame]
                return ancestor_target.joined(
                    ancestor_source, se3.inverse(ancestor_target.T_target_source)
                    @ ancestor_source.T_target_source)
        return None

    def _chain(self, frame: str, stamp: int) -> dict[str, FrameTransform]:
        """Return the transforms from a frame to itself and each of its ancestors, in order."""
        chain: dict[str, FrameTransform] = {}
        reached = FrameTransform(np.eye(4))
        while frame not in chain:  # a loop of frames ends where it began
            chain[frame] = reached
            if frame in self._static:
                parent, T_parent_frame = self._static[frame]
                frame, link = parent, FrameTransform(T_parent_frame)
            elif frame in self._dynamic:
                frame, link = self._dynamic[frame].parent, self._dynamic[frame].at(stamp)
            else:
                break
            reached = link.joined(reached, link.T_target_source @ reached.T_target_source)
        return chain


def _is_near(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether a link that has had both poses may have rested meanwhile."""
    change = (one - other)[:3]
    # |R1 - R2|^2 = 4 (1 - cos angle), in the Frobenius norm
    return bool(np.vdot(change[:, 3], change[:, 3]) <= _REST_DISTANCE ** 2
                and np.vdot(change[:, :3], change[:, :3]) <= 4 * (1 - math.cos(_REST_ANGLE)))
