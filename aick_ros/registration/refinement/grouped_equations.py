# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Normal equations added up over the registrations of a camera, in groups for a jackknife.

One pair of frames hardly distinguishes an error of the camera from others, but all pairs have the
same one. A delete-a-group jackknife (Shao and Tu 1995) shows how far parts of the registrations
contradict each other.
"""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import definite

# Chosen on two excerpts of real recordings and on rendered rooms with nine kinds of cameras.
_GROUPS = 8
_JACKKNIFE = (_GROUPS - 1) / _GROUPS  # by definition: variance by the squares that it sums up
RUN = 5  # successive registrations of one group: their errors are alike

MEMORY = _GROUPS * RUN
"""Registrations after which the first group is added to again."""


class GroupedEquations:
    """
    Sums of normal equations.

    :param prior: information that is added to the sums, NxN.
    :param kept: weight of a group's earlier registrations, each time that it is added to.
    """

    def __init__(self, prior: np.ndarray, kept: float) -> None:
        size = len(prior)
        self._prior, self._kept = prior, kept
        self._information = np.zeros((_GROUPS, size, size))
        self._gradient = np.zeros((_GROUPS, size))
        self.count = 0
        """Number of registrations that were added."""

    @property
    def is_between_runs(self) -> bool:
        """Completeness of the last run of registrations."""
        return self.count % RUN == 0

    @property
    def groups(self) -> int:
        """Number of groups that have had a whole run of registrations."""
        return min(self.count // RUN, _GROUPS)

    def add(self, information: np.ndarray, gradient: np.ndarray) -> None:
        """Add the equations of one registration."""
        group = self.count // RUN % _GROUPS
        if self.is_between_runs:
            self._information[group] *= self._kept
            self._gradient[group] *= self._kept
        self.count += 1
        self._information[group] += information
        self._gradient[group] += gradient

    def solve(self, chosen: np.ndarray,
              known: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the deviations from known values, and by how much each group changes them.

        Where rounding leaves the equations not definite nothing is known: the deviations are
        zero, and the changes infinite.

        :param chosen: the unknowns that are estimated; the others are zero.
        :returns: N, and N for each group.
        """
        size = len(self._prior)
        estimate, scatter = np.zeros(size), np.zeros((_GROUPS, size))
        if not kernels.jackknife(self._information, self._gradient, self._prior,
                                 np.full(size, known), chosen, estimate, scatter):
            return np.zeros(size), np.full((_GROUPS, size), np.inf)
        return estimate, scatter

    def significance(self, part: slice, estimate: np.ndarray, scatter: np.ndarray) -> float:
        """
        Return the square of a part of an estimate by its variance, weighted by the information.

        Where the n unknowns are zero and the groups independent, its distribution is between
        F(n, 7 n), if all directions have the same noise, and F(1, 7), if one has nearly all.
        """
        if not np.isfinite(scatter).all():
            return 0.0
        metric = self._information.sum(axis=0)[part, part]
        variance = _JACKKNIFE * float(np.vdot(scatter[:, part] @ metric, scatter[:, part]))
        square = float(estimate[part] @ metric @ estimate[part])
        return square / variance if variance > 0.0 else 0.0

    def variances(self, scatter: np.ndarray) -> np.ndarray:
        """Return the variances of an estimate by how much each group changes it, N."""
        variances: np.ndarray = _JACKKNIFE * np.einsum('ij,ij->j', scatter, scatter)
        return variances

    def covariance(self, chosen: np.ndarray) -> np.ndarray:
        """
        Return the covariance of the unknowns that are estimated, if no residuals are correlated.

        :param chosen: K of them; the others are zero.
        :returns: KxK.
        """
        information = self._information.sum(axis=0) + self._prior
        return definite.inverse(information[np.ix_(chosen, chosen)])

    def full_covariance(self, scatter: np.ndarray, design_effect: float) -> np.ndarray:
        """
        Return the covariance of an estimate of all unknowns, by its information and its scatter.

        :param design_effect: of the information.
        :returns: NxN; infinite where the equations are not definite.
        """
        if not np.isfinite(scatter).all():
            return np.full(self._prior.shape, np.inf)
        every = np.arange(len(self._prior))
        covariance: np.ndarray = (design_effect * self.covariance(every)
                                  + _JACKKNIFE * scatter.T @ scatter)
        return covariance
