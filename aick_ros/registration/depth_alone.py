# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Registration of two depth images where the colour images show too little.

Point-to-plane distances hold the camera in all directions in which the scene has shape: a room
with furniture in all six, a single wall along its normal and in two rotations. The rest is left
to the motion that is expected, with its covariance. The expected motion is part of the same
least-squares problem, so no threshold decides which directions count as observed.

Chains of registrations drift, the faster the less of a view the next one shows. So earlier views
of the same take part too, as a map would: each frame is held where all of them see it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import CELL, FINE_CELL, Surface, cell_of
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.depth_pair import DepthPair, KnownView
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment import Correction, Misalignment
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings

_MOST_STEPS = 12  # chosen: planes are associated anew in each
_SMALLEST_STEP = 1e-4  # m and rad; chosen: a smaller step ends the iteration
_FINE_POINTS = 10
"""Points of a fine surface, as a ratio to ``refinement.surface_points``.

Without keypoints there is time for them. Chosen on two excerpts of real recordings and on eleven
rendered rooms with four kinds of cameras: two seconds of dark end as near to the truth as with a
ratio of one on the former, up to 2.6 times nearer on the latter."""

_LAST_STEPS = 3  # chosen: with all of these points; steps before have those that count alone
_LEAST_CURVATURE = 0.2  # chosen: along a step, as a ratio to what the derivatives claim
_FEWEST_POINTS = 300  # chosen: with fewer the depth image has too many holes
_MIN_OVERLAP = 0.5  # chosen on rendered rooms: share of the points that must lie on a plane
_SHARED_BOUNDS = 0.3, 0.6
"""Share of the points that another view shows, where the frame is expected. Up to the first it has
no part, from the second on a whole one, linear in between, so that none comes or goes at once.
Chosen on an excerpt of a real recording and six rendered rooms."""

_CACHED_FRAMES = 12  # chosen: the frame, the shape, the last frame, and views that come and go
_COARSE, _FINE = 0, 1  # by definition: the surfaces of a frame


class DepthAlone:
    """
    Registers depth images to each other, from an expected pose.

    :param noise: of the camera; the bias between keypoints and depth is an error of such a pose.
    :param misalignment: of the camera, by which depth is corrected.
    """

    def __init__(self, settings: Settings, noise: MeasuredNoise | None = None,
                 misalignment: MisalignmentEstimate | None = None) -> None:
        self._settings = settings
        self._noise = noise or MeasuredNoise()
        self._misalignment = misalignment or MisalignmentEstimate()
        self.forget()

    def forget(self) -> None:
        """Forget the surfaces of the last frames, which take some megabytes each."""
        self._surfaces = LastResults(self._new_surfaces, _CACHED_FRAMES)
        self._edges = LastResults(self._new_edges, _CACHED_FRAMES)

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: PoseWithCovariance, unobserved: np.ndarray,
                 others: Sequence[KnownView] = ()) -> Registration:
        """
        Return the pose of the source in the target by depth and by the motion expected.

        It fails where too few points of the source lie on surfaces of the target.

        :param expected: ``T_target_source`` by the motion model since the last frame.
        :param unobserved: 6x6, the covariance of the pose if no frame had been registered since
            keypoints were last seen.
        :param others: views beside the target; those that show much of the same have a part too.
        """
        if source.surface is None or target.repeat is Repeat.DEPTH:
            return failed(Status.TOO_FEW_KEYPOINTS, '0 points with depth')
        surface = self._surfaces(source.frame)[_COARSE]
        count = len(surface.chosen)
        if count < _FEWEST_POINTS:
            return failed(Status.TOO_FEW_KEYPOINTS, f'{count} points with depth')
        views = [(KnownView(target, np.eye(4)), 1.0),
                 *self._weighted(source, others, expected.matrix)]
        coarse, fine = (self._pairs(source, views, of, expected.matrix)
                        for of in (_COARSE, _FINE))
        pose = _solve(fine, expected, _solve(coarse, expected, expected.matrix))
        pose = _solve(fine, expected, pose, _LAST_STEPS, with_all=True)
        overlap = coarse[0].overlap(pose)
        reason = f'by depth alone, {overlap:.0%} of {count} points'
        if overlap < _MIN_OVERLAP:
            return failed(Status.TOO_FEW_MATCHES, reason)
        bias = self._noise.expected(
            _displacement(surface, pose, source.frame.camera.fx)).bias
        return Registration(
            Status.OK, reason, pose, fine[0].covariance(pose, unobserved) + bias,
            np.empty((0, 2), np.intp), 0, evidence=Evidence.DEPTH_ALONE, systematic=bias,
            overlap=overlap)

    def _weighted(self, source: PreparedFrame, views: Sequence[KnownView],
                  T_target_source: np.ndarray) -> Iterator[tuple[KnownView, float]]:
        """
        Yield the views that show much of what a frame does, and their weights.

        Surfaces take time to be made: with each frame those of one more view alone.
        """
        none_is_new = True
        nothing, all_of_it = _SHARED_BOUNDS
        for view in views:
            is_known = self._surfaces.knows(view.prepared.frame)
            if view.prepared.repeat is Repeat.DEPTH or not (is_known or none_is_new):
                continue
            none_is_new &= is_known
            shared = self._pair(source, view, _COARSE).overlap(T_target_source)
            if shared > nothing:
                yield view, min((shared - nothing) / (all_of_it - nothing), 1.0)

    def _pairs(self, source: PreparedFrame, views: Sequence[tuple[KnownView, float]], of: int,
               expected: np.ndarray) -> list[DepthPair]:
        """Return the pairs with views, with edges where planes of the target hide a motion."""
        pairs = [self._pair(source, view, of, weight) for view, weight in views]
        if pairs[0].hidden_near(expected) is None:
            return pairs
        own = self._edges(source.frame)
        return [pair.with_edges((own, self._edges(view.prepared.frame)), expected)
                for pair, (view, _) in zip(pairs, views)]

    def _pair(self, source: PreparedFrame, view: KnownView, of: int,
              weight: float = 1.0) -> DepthPair:
        """Return the depth of two frames, of their coarse or their fine surfaces."""
        surfaces = self._surfaces(source.frame)
        return DepthPair(
            surfaces[of], self._surfaces(view.prepared.frame)[of], view.T_view_target,
            _correction(source, view.prepared, self._misalignment.misalignment), self._settings,
            weight, max(len(surfaces[of].chosen) // len(surfaces[_COARSE].chosen), 1))

    def _new_surfaces(self, frame: RgbdFrame) -> tuple[Surface, Surface]:
        """Return the coarse and the fine surface of a frame."""
        count, cell = self._settings.refinement.surface_points, cell_of(frame.camera)
        fine_cell = max(cell * FINE_CELL // CELL, 1)
        coarse, fine = (Surface.of(frame.depth, frame.camera, self._settings.sensor, points, side)
                        for points, side in ((count, cell), (_FINE_POINTS * count, fine_cell)))
        return coarse, fine

    def _new_edges(self, frame: RgbdFrame) -> DepthEdges:
        """Return the edges of a frame."""
        return DepthEdges.of(frame.depth, frame.camera, self._settings.sensor)


def shows_enough(prepared: PreparedFrame) -> bool:
    """Return whether a frame has depth enough to be registered by it alone."""
    return prepared.surface is not None and len(prepared.surface.chosen) >= _FEWEST_POINTS


def _solve(pairs: Sequence[DepthPair], expected: PoseWithCovariance, pose: np.ndarray,
           most_steps: int = _MOST_STEPS, with_all: bool = False) -> np.ndarray:
    """
    Return the pose at the minimum near a first one, 4x4: by all pairs and the expected one.

    :param with_all: with all points, or with those that count alone.
    """
    prior, before = np.linalg.inv(expected.covariance), None
    for _ in range(most_steps):
        information, gradient = prior, prior @ se3.difference(pose, expected.matrix)
        for pair in pairs:
            equations = pair.equations(pose, with_all)
            information = information + equations.information
            gradient = gradient + equations.gradient
        if before is not None:
            information = _with_secant(information, *before, gradient)
        step = -np.linalg.solve(information, gradient)
        before = step, gradient
        pose = se3.perturbed(pose, step)
        if np.abs(step).max() < _SMALLEST_STEP:
            break
    return pose


def _with_secant(information: np.ndarray, step: np.ndarray, before: np.ndarray,
                 gradient: np.ndarray) -> np.ndarray:
    """
    Return the information along the last step as the gradient has changed by it, 6x6.

    Noise of the normals makes a wall look rough. By their derivatives its points hold the camera
    along the wall; but a point that moves on is paired with another plane, and hardly does. By the
    derivatives alone each step would be a small part of what is needed.

    :param step: the last one, 6.
    :param before: gradient before it, 6; ``gradient``: after it.
    """
    along = information @ step
    claimed = float(step @ along)
    share = max(float(step @ (gradient - before)) / claimed, _LEAST_CURVATURE)
    return information - max(1.0 - share, 0.0) / claimed * np.outer(along, along)


def _correction(source: PreparedFrame, target: PreparedFrame,
                misalignment: Misalignment) -> Correction:
    """
    Return what corrects two depth images, to the times of their colour images.

    A target whose velocity is not known moves as the source does; without any both are at rest.
    """
    twist = np.zeros(6) if source.twist is None else source.twist
    twists = np.array([twist, twist if target.twist is None else target.twist])
    return Correction.of(misalignment, (source.depth_lag, target.depth_lag), twists,
                         (source.frame.camera, target.frame.camera))


def _displacement(surface: Surface, pose: np.ndarray, focal_length: float) -> float:
    """Return how far a motion displaces the image of a surface in the mean [px]."""
    points = surface.points.take(surface.chosen, 0).astype(np.float64)
    moved = se3.transform(pose, points)
    moved, points = moved[moved[:, 2] > 0], points[moved[:, 2] > 0]
    if not len(points):
        return 0.0
    shifts = moved[:, :2] / moved[:, 2:] - points[:, :2] / points[:, 2:]
    return focal_length * float(np.mean(np.linalg.norm(shifts, axis=1)))
