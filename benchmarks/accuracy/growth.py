# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Growth of the error of a path with the distance travelled."""

from __future__ import annotations

import numpy as np

from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors
from aick_ros.geometry import se3

DISTANCES = (0.1, 0.2, 0.5, 1.0, 2.0, 4.0)  # [m]
FEWEST = 20  # parts of a path; the figure of fewer says nothing


def growth(errors: TrajectoryErrors) -> dict[str, dict[str, float]]:
    """
    Return the errors of the motion over parts of the path, of all parts that are so long.

    :returns: distance along the true path [m] as text -> ``count`` of parts, RMSE of translation
        and rotation; distances of which the path has too few parts are left out.
    """
    truth, estimate = errors.truth.poses, errors.estimate.poses
    gone = np.r_[0.0, np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).cumsum()]
    figures = {}
    for distance in DISTANCES:
        ends = np.searchsorted(gone, gone + distance)
        parts = [(i, j) for i, j in enumerate(ends) if j < len(gone)]
        if len(parts) < FEWEST:
            continue
        off = [se3.inverse(se3.inverse(truth[i]) @ truth[j])
               @ se3.inverse(estimate[i]) @ estimate[j] for i, j in parts]
        figures[f'{distance:g}'] = {
            'count': len(parts),
            'translation_rmse_m': root_mean_square(np.linalg.norm(e[:3, 3]) for e in off),
            'rotation_rmse_deg': root_mean_square(
                np.degrees(se3.angle(e[:3, :3])) for e in off)}
    return figures
