# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keyframes that are kept, and the pose as they determine it once they are found again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance, in_axes
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.kept_frame import Mappings, compact, size
from aick_ros.odometry.keyframe_copies import KeyframeCopies
from aick_ros.odometry.keyframe_graph import KeyframeGraph
from aick_ros.odometry.keyframe_search import KeyframeSearch, candidates, view_distances
from aick_ros.odometry.pose_correction import PoseCorrection
from aick_ros.odometry.reference import Reference
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings

Fuse = Callable[[PoseWithCovariance], PoseWithCovariance]

_LONGEST_WAITS = {Effort.LEAST: 0, Effort.MORE: 1, Effort.MUCH: 3}
"""Frames that a step of a search has waited for one that leaves time, up to which it waits on.

Chosen: a search ends within its interval at 30 Hz, though a camera that turns fast may make each
frame a keyframe. Frames that take several refinements are few, and take the longest."""

_SPARE = 1  # by definition: a new keyframe comes before an old one goes

_SLOW_INTERVAL = 0.06
"""Interval of frames [s] from which a whole registration is done with each.

Chosen: at 15 Hz there is time for it, and searches that wait find a fifth fewer places again."""


class KeyframeMemory:
    """
    Corrects dead reckoning by keyframes that are found again.

    Dead reckoning is the chain of the keyframes alone. The memory keeps them in a graph, adds
    what is measured when one is found again, and lets the published pose approach the solution.

    :param first: the first keyframe; the published pose begins at its pose.
    :param fuse: returns a pose with what is known of it beside the images, as of a plane.
    """

    def __init__(self, settings: Settings, registrar: Registrar, first: Reference,
                 fuse: Fuse = lambda pose: pose) -> None:
        self._fuse = fuse
        self._graph = KeyframeGraph(0, first.pose)
        self._frames = {0: first.prepared}
        self._view_covariances = {0: np.zeros((6, 6))}
        self._newest, self._reckoned = 0, first.pose
        self._found = PoseWithCovariance.identity()  # the last one that was found again
        self._added: list[int] = []  # keys of those that nothing else was done for
        self._put_off = 0  # frames that have left no time for that
        self._copies = KeyframeCopies()
        self._no_copies: set[int] = set()  # until poses change, or what searches have missed
        self._search: KeyframeSearch | None = None
        self._searched = first.stamp
        self._waited = 0  # frames that have left no time for the search
        self._correction = PoseCorrection(settings.odometry)
        self._error = np.zeros(6)  # of the published pose, not corrected yet
        self.reused = 0
        self.configure(settings, registrar)
        self._mappings = Mappings(self._capacity + _SPARE)
        self._frames[0] = compact(first.prepared, self._mappings)

    @property
    def frames(self) -> tuple[PreparedFrame, ...]:
        """The keyframes that are kept, oldest first."""
        return tuple(self._frames.values())

    def configure(self, settings: Settings, registrar: Registrar) -> None:
        """Continue with other settings; without a refinement no search can be completed."""
        self._settings, self._registrar = settings, registrar
        if settings.refinement.mode == 'none':
            self._search = None
        self._no_copies.clear()
        self._correction.configure(settings.odometry)

    def track(self, keyframe: Reference, T_reckoned_camera: np.ndarray,
              detour: np.ndarray, interval: float, effort: Effort = Effort.LEAST) -> None:
        """
        Advance by one tracked frame.

        A search takes a step with frames that are no keyframes and easy to register: others take
        the longest already. What is due for a new keyframe waits too, where that frame took the
        longest. Where frames come slowly nothing waits.

        :param keyframe: of the next frame, its pose by dead reckoning.
        :param T_reckoned_camera: pose of the frame by dead reckoning, 4x4.
        :param detour: 6x6, added to the covariance of a new keyframe that was not registered to
            the one before.
        :param interval: since the frame before [s].
        :param effort: that the registration of the frame has taken.
        """
        newest, prepared = self._frames[self._newest], keyframe.prepared
        if keyframe.stamp != newest.stamp:
            self._add(keyframe, detour)
        elif newest.twist_variances is None and prepared.twist is not None:  # as of a first frame
            self._frames[self._newest] = newest.moving(prepared.twist, prepared.twist_variances)
        if interval >= _SLOW_INTERVAL:
            effort = Effort.LEAST
        if self._added and not self._puts_off(effort):
            self._process_new_keyframes()
            effort = max(effort, Effort.MORE)
        self._continue_search(effort, interval)
        if self.reused == 0:
            return
        T_odom_reckoned = self._keyframe_pose.matrix @ se3.inverse(self._reckoned.matrix)
        self._error = self._correction.approach(
            T_odom_reckoned @ T_reckoned_camera, T_reckoned_camera, interval)

    def published(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """
        Return the pose that is published for one by dead reckoning.

        Its covariance is that of the newest keyframe in the graph, of the error that all
        registrations of a view found again share, of the motion since, and of the correction that
        is left.
        """
        if self.reused == 0:
            return pose
        newest = self._keyframe_pose
        shared = self._found @ (se3.inverse(self._found.matrix) @ newest.matrix)
        keyframe = newest.with_covariance(newest.covariance + shared.covariance)
        estimate = keyframe @ pose.since(self._reckoned)
        return PoseWithCovariance(self.T_odom_reckoned @ pose.matrix,
                                  estimate.covariance + np.outer(self._error, self._error))

    @property
    def T_odom_reckoned(self) -> np.ndarray:
        """Transform from the frame of the dead reckoning to that of the published poses, 4x4."""
        return self._correction.T_odom_reckoned

    @property
    def _keyframe_pose(self) -> PoseWithCovariance:
        """The newest keyframe by the graph, and by what is known beside: places alone may tilt."""
        return self._fuse(self._graph.pose(self._newest))

    def keypoints_from(self, pose: PoseWithCovariance) -> np.ndarray:
        """
        Return the keypoints of all keyframes in the frame of a camera, Nx3 [m].

        :param pose: of the camera, by dead reckoning.
        """
        T_odom_camera = (self._graph.pose(self._newest) @ pose.since(self._reckoned)).matrix
        return np.concatenate([
            se3.transform(se3.inverse(T_odom_camera) @ T_odom_keyframe,
                          self._frames[key].keypoints.positions)
            for key, T_odom_keyframe in zip(self._graph.keys, self._graph.matrices)])

    def views_beside(self, T_newest_target: np.ndarray, count: int) -> list[KnownView]:
        """
        Return the keyframes whose views are nearest to that of a frame, some at most.

        :param T_newest_target: pose of the frame in the newest keyframe, 4x4.
        """
        T_odom_target = self._graph.pose(self._newest).matrix @ T_newest_target
        poses = self._graph.matrices
        apart = view_distances(poses, T_odom_target[None], self._settings.odometry)[:, 0]
        return [KnownView(self._frames[self._graph.keys[row]],
                          se3.inverse(poses[row]) @ T_odom_target)
                for row in np.argsort(apart, kind='stable')[:count]]

    def _add(self, keyframe: Reference, detour: np.ndarray) -> None:
        """Add a keyframe to the graph."""
        key, parent = self._newest + 1, self._newest
        # after a loss an earlier frame can become the keyframe again
        motion = (keyframe.pose.since(self._reckoned)
                  if keyframe.stamp > self._frames[parent].stamp
                  else self._reckoned.since(keyframe.pose).inverse())
        motion = motion.with_covariance(motion.covariance + detour)
        self._graph.add(key, motion, parent)
        axes = in_axes(self._graph.pose(parent).rotation)
        self._frames[key] = keyframe.prepared
        self._added.append(key)
        self._view_covariances[key] = axes @ motion.covariance @ axes.T
        self._newest, self._reckoned = key, keyframe.pose

    def _puts_off(self, effort: Effort) -> bool:
        """Return whether what is due for new keyframes waits for a frame with less effort."""
        self._put_off += 1
        return effort is Effort.MUCH and self._put_off <= _LONGEST_WAITS[effort]

    def _process_new_keyframes(self) -> None:
        """Compact new keyframes, drop redundant ones, and begin a search if it is due."""
        for key in self._added:
            self._frames[key] = compact(self._frames[key], self._mappings)
        self._added.clear()
        self._put_off = 0
        self._drop_redundant()
        key, stamps = self._newest, {key: frame.stamp for key, frame in self._frames.items()}
        interval = self._settings.odometry.reuse_interval * NANOSECONDS
        if self._search is None and stamps[key] - self._searched >= interval:
            chosen = candidates(self._graph, key, stamps, self._settings.odometry)
            if chosen:
                self._search, self._searched = KeyframeSearch(key, chosen), stamps[key]

    def _continue_search(self, effort: Effort, interval: float) -> None:
        """Do a step of the search, if there is one and the frame leaves time; or a few of them."""
        if self._search is None:
            return
        self._waited += 1
        if interval < _SLOW_INTERVAL and self._waited <= _LONGEST_WAITS[effort]:
            return
        self._waited = 0
        self._step(self._search)
        while interval >= _SLOW_INTERVAL and self._search is not None and self._search.has_begun:
            self._step(self._search)

    def _step(self, search: KeyframeSearch) -> None:
        """Do a part of a registration of a search, and correct the graph by what is accepted."""
        if not search.has_begun:
            self._prepare_for(search)
        accepted = search.step(self._graph, self._frames, self._registrar, self._settings)
        if accepted:
            self._graph.update(accepted)
            self._no_copies.clear()
            self.reused += len(accepted)
            self._found = PoseWithCovariance(self._graph.pose(search.key).matrix,
                                             self._view_covariances[search.key])
        if search.is_finished:
            self._copies.learn(search, self._graph, self._settings.odometry)
            self._no_copies.clear()
            self._search = None

    def _prepare_for(self, search: KeyframeSearch) -> None:
        """Bring the keyframes of a search to one preparation, by the settings of now."""
        newest = self._registrar.prepared_again(self._frames[search.key])
        candidate = self._registrar.prepared_like(self._frames[search.candidate], newest)
        for key, prepared in ((search.key, newest), (search.candidate, candidate)):
            if prepared is not self._frames[key]:
                self._frames[key] = compact(prepared, self._mappings)

    def _drop_redundant(self) -> None:
        """Drop copies, then keyframes until they are few enough: of two alike the older one."""
        while (droppable := self._droppable):
            key = self._copies.copy_among(set(droppable) - self._no_copies, self._graph,
                                          self._settings.odometry)
            if key is None:
                self._no_copies.update(  # they are the only ones of their views
                    key for key in droppable if not self._copies.is_outdated(key))
                if len(self._frames) <= self._capacity:
                    return
                key = self._most_redundant(droppable)
            self._graph.remove(key)
            self._copies.forget(key)
            self._no_copies.discard(key)
            del self._frames[key], self._view_covariances[key]

    @property
    def _droppable(self) -> list[int]:
        """Keys of the keyframes that are neither the newest one nor compared."""
        needed = {self._newest} | (self._search.keys if self._search else set())
        return [key for key in self._graph.keys if key not in needed]

    def _most_redundant(self, droppable: list[int]) -> int:
        """Return the keyframe whose view is nearest to that of a newer one."""
        keys, poses = self._graph.keys, self._graph.matrices
        apart = view_distances(poses, poses, self._settings.odometry)
        apart[np.tril_indices(len(keys))] = np.inf
        nearest = dict(zip(keys, apart.min(axis=1)))
        return min(droppable, key=nearest.__getitem__)

    @property
    def _capacity(self) -> int:
        """Most keyframes that are kept."""
        odometry = self._settings.odometry
        # without a refinement no image confirms that a place is the same
        if odometry.reference == 'previous' or self._settings.refinement.mode == 'none':
            return 1
        taken = size(self._frames[self._newest])
        affordable = int(odometry.keyframe_megabytes * 1e6 / taken)
        return max(1, min(odometry.max_keyframes, affordable - _SPARE))
