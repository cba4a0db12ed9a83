# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Objects that move by themselves, excluded from the least-squares problem of two frames.

Those that other frames have shown are excluded from the first step on. From a pose so found all
tracks are looked at: those that lie together and are far off are on objects, and so are those
which fit the motion of an object found far better than that of the scene. Of known objects tracks
need not be far off, but only farther than those of the scene: what moves slowly at times does not
pull the pose, and what has stopped becomes a part of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.found_objects import FoundObjects, Places
from aick_ros.registration.refinement import object_places
from aick_ros.registration.refinement.residuals import (
    PRIOR, NormalEquations, Residuals, are_far_smaller, reprojection, squared_errors, track_steps)
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.settings import RefinementSettings, SensorSettings

# All chosen on rendered rooms through which boards, people, stacks of cartons and posters move.
LEAST_SHARE = 0.2
"""Share of the tracks that must be on objects.

On two excerpts of real recordings and four kinds of rendered cameras up to 2 % of the
registrations have so many far off without an object."""

_STEPS = 3.0, 1.0, 1.0, 1.0  # widths of the robust weights in the steps to an object's motion


@dataclass(frozen=True)
class _Scales:
    """Settings by which tracks are compared to a pose."""

    camera: Camera  # of the source
    ray_sigma: float
    refinement: RefinementSettings
    sensor: SensorSettings


class MovingObjects:
    """
    The tracks and points of two frames that are not on moving objects; at first all.

    Tracks are given to each method, as they are corrected by then: always all of them, in order.

    :param count: number of tracks.
    :param surface: of the source, whose chosen points the problem has; None: no depth, and nothing
        is excluded.
    :param ray_sigma: standard deviation of a track on the plane z = 1.
    """

    def __init__(self, count: int, surface: Surface | None, camera: Camera, ray_sigma: float,
                 settings: RefinementSettings, sensor: SensorSettings) -> None:
        self.kept = np.ones(count, bool)
        """Tracks of the scene, K bool: neither on objects nor beside them."""
        self.surface = surface
        """The surface with the chosen points of the scene."""
        self._whole = surface
        self._scales = _Scales(camera, ray_sigma, settings, sensor)
        self._moving = np.zeros(count, bool)
        self._known = np.zeros(count, bool)  # by other frames
        self._known_scene = np.empty((0, 3))  # in the source [m]
        self._seen = 0  # the last frame in which known objects moved [ns]
        self._others: Tracks | None = None  # on objects, that the problem does not have
        self._places_of_others = np.empty((0, 3))

    def recall(self, known: Places, tracks: Tracks, pose: np.ndarray) -> None:
        """Recall what is known of the target, by a pose ``T_target_source``."""
        self._known = ~object_places.are_of_scene(
            tracks.seen_by_target(pose), known.scene, known.objects)
        if self._known.any():
            self._known = object_places.as_neighbours(tracks.points, self._known)
        self._known_scene = se3.transform(se3.inverse(pose), known.scene)
        self._seen = known.seen

    def leave_out(self, others: Tracks, tracks: Tracks, pose: np.ndarray) -> None:
        """Leave out the depth of objects that tracks show which the problem does not have."""
        self._others, self._places_of_others = others, object_places.places(others, pose)
        self._choose_points(tracks, self._places_of_others)

    def leave_out_known(self, tracks: Tracks, pose: np.ndarray) -> None:
        """Leave out the objects recalled, as long as enough tracks are left."""
        if np.count_nonzero(~self._known) >= FEWEST_TO_CONFIRM:
            self._leave_out(self._known, tracks, pose)

    def search(self, tracks: Tracks, pose: np.ndarray, least_share: float) -> bool:
        """
        Leave out the objects that a pose shows, and nothing else.

        :param pose: ``T_target_source`` of the scene.
        :param least_share: of the tracks that must be on objects.
        :returns: whether they are others than before.
        """
        if self._whole is None:
            return False
        errors = self._errors(tracks, pose)
        are_far_off, squares = errors.weights[:len(tracks)] == 0.0, squared_errors(errors)
        if self._known.any() and not self._known.all():
            typical = float(np.median(squares[~self._known]))
            are_far_off |= self._known & are_far_smaller(typical, squares)
        if np.count_nonzero(self._moving) >= FEWEST_TO_CONFIRM:
            are_far_off |= are_far_smaller(self._squares_by_own_motion(tracks, pose), squares)
        return self._leave_out(
            object_places.on_objects(tracks, are_far_off, least_share), tracks, pose)

    def _squares_by_own_motion(self, tracks: Tracks, pose: np.ndarray) -> np.ndarray:
        """Return the squared errors of all tracks by the motion that those on objects share."""
        by, moving = self._scales, tracks[self._moving]
        first = pose.copy()
        first[:3, 3] += pose[:3, :3] @ object_places.displacement(moving, pose)
        own, _ = track_steps(moving, first, by.ray_sigma, by.sensor, by.refinement.robust_width,
                             _STEPS, 1.0, NormalEquations.of((), PRIOR))
        return squared_errors(self._errors(tracks, own))

    def _errors(self, tracks: Tracks, pose: np.ndarray) -> Residuals:
        return reprojection(tracks, pose, self._scales.ray_sigma,
                            self._scales.refinement.robust_width)

    def _leave_out(self, moving: np.ndarray, tracks: Tracks, pose: np.ndarray) -> bool:
        """Leave out tracks and what belongs to them; return whether others were before."""
        if self._whole is None or np.array_equal(moving, self._moving):
            return False
        self._moving, self.kept = moving, ~moving
        left_out = self._choose_points(tracks, np.vstack([
            self._places_of_others, object_places.places(tracks[moving], pose)]))
        beside = object_places.are_beside(tracks, left_out, self._scales.camera,
                                          self._scales.refinement.track_window / 2)
        if np.count_nonzero(self.kept & ~beside) >= FEWEST_TO_CONFIRM:
            self.kept &= ~beside
        return True

    def _choose_points(self, tracks: Tracks, objects: np.ndarray) -> np.ndarray:
        """Take those points of depth that are not on objects; return the others, Nx3."""
        whole = self._whole
        if whole is None:
            return np.empty((0, 3))
        points = whole.points.take(whole.chosen, axis=0)
        scene = np.vstack([tracks.points[~self._moving], self._known_scene])
        kept = object_places.are_of_scene(points, scene, objects)
        self.surface = replace(whole, chosen=whole.chosen[kept])
        left_out: np.ndarray = points[~kept]
        return left_out

    @property
    def scene_share(self) -> float:
        """Share of the points of depth that are not on objects."""
        if self.surface is None or self._whole is None:
            return 1.0
        return len(self.surface.chosen) / max(len(self._whole.chosen), 1)

    def known_share(self, agreeing: np.ndarray) -> float:
        """Return the share of tracks, by their rows, that are on objects recalled."""
        return float(self._known[agreeing].mean()) if len(agreeing) else 0.0

    def found(self, tracks: Tracks, agreeing: np.ndarray, pose: np.ndarray,
              stamp: int) -> FoundObjects | None:
        """
        Return the objects found or, where those recalled do not move, these; None without any.

        :param agreeing: rows of the tracks that agree with the pose of the scene.
        :param stamp: of the later frame [ns].
        """
        moving, others, seen = self._moving, self._others, stamp
        if not moving.any() and others is None:
            moving, seen = self._known, self._seen
        objects = tracks[moving]
        if others is not None:
            objects = objects.joined(others)
        if not len(objects):
            return None
        return FoundObjects.of(tracks[agreeing[~moving[agreeing]]], objects, pose, seen)
