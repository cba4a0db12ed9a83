# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Views of what a frame in the dark is expected to show: keyframes, and frames in the dark."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.geometry import se3
from aick_ros.odometry.keyframe_search import view_distances
from aick_ros.odometry.reference import Reference, References
from aick_ros.registration.depth_pair import KnownView
from aick_ros.settings import OdometrySettings

_MOST = 4
"""Views beside the one that a frame is registered to. Chosen on an excerpt of a real recording and
six rendered rooms: more of them change nothing."""


ViewsBeside = Callable[[np.ndarray, int], list[KnownView]]
"""Returns some of the keyframes in memory, as :meth:`KeyframeMemory.views_beside` does."""


def known_views(references: References, views_beside: ViewsBeside, target: Reference,
                T_target_source: np.ndarray, settings: OdometrySettings) -> list[KnownView]:
    """
    Return the views that are nearest to where a frame is expected, nearest first.

    :param views_beside: returns keyframes near a frame, beside the depth references.
    :param target: what the frame is registered to; it is none of them.
    :param T_target_source: where it is expected, 4x4.
    """
    T_newest_target = se3.inverse(references.keyframe.pose.matrix) @ target.pose.matrix
    views = [*views_beside(T_newest_target, _MOST + 1),
             *(KnownView(reference.prepared,
                         se3.inverse(reference.pose.matrix) @ target.pose.matrix)
               for reference in references.earlier_depth_references)]
    views = [view for view in views if view.prepared.stamp != target.stamp
             and references.are_linked(view.prepared.stamp, target.stamp)]
    if not views:
        return []
    poses = np.array([se3.inverse(view.T_view_target) for view in views])
    apart = view_distances(poses, T_target_source[None], settings)[:, 0]
    return [views[row] for row in np.argsort(apart, kind='stable')[:_MOST]]
