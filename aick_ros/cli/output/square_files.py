# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files of ``aick evaluate --export``: a trajectory with covariances, for independent scorers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from aick_ros import __version__
from aick_ros.cli.output.files import write_whole
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.motion_consistency import reference_poses
from aick_ros.geometry.pose import in_axes
from aick_ros.geometry.trajectory import Trajectory, format_pose

_LOWER = np.tril_indices(6)


def write_square(folder: Path, records: Sequence[FrameRecord],
                 ground_truth: Trajectory | None) -> None:
    """
    Write estimate.SQUARE, and reference.SQUARE if there is ground truth, into a folder.

    The format is SQUARE/0.3, text with a line per pose, which smfeval reads. Poses without error
    by definition, the first one, and those with an infinite covariance are omitted.

    :raises InputError: where they cannot be written.
    """
    write_whole(folder / 'estimate.SQUARE',
                _text([*_header('gaussian_se3'), '#%TANGENT_CONVENTION right_perturbation',
                       '#%TANGENT_ORDER translation_rotation', '#%ROTATION_PARAM axis_angle'],
                      map(_line, _with_covariance(records))))
    if ground_truth is not None:
        truth = reference_poses(records, ground_truth)
        write_whole(folder / 'reference.SQUARE', _text(
            _header('deterministic'), (format_pose(record.stamp, pose) for record, pose in truth)))


def _header(representation: str) -> list[str]:
    """Return the lines that both files begin with; the gauge says that nothing is aligned."""
    return ['#%FORMAT SQUARE/0.3', f'#%REPRESENTATION {representation}', '#%POSE_FRAME odom',
            '#%BODY_FRAME camera', '#%GAUGE fixed', '#%TIMESTAMP_UNIT seconds',
            '#%ALGORITHM aick_ros', f'#%ALGORITHM_VERSION {__version__}']


def _with_covariance(records: Sequence[FrameRecord]) -> Iterator[FrameRecord]:
    for record in records:
        covariance = record.pose.covariance
        if np.isfinite(covariance).all() and (np.diag(covariance) > 0.0).all():
            yield record


def _line(record: FrameRecord) -> str:
    """
    Return stamp, position, quaternion and the lower triangle of the covariance, row by row.

    A right perturbation is an error in the axes of the camera.
    """
    turn = in_axes(record.pose.rotation.T)
    covariance = turn @ record.pose.covariance @ turn.T
    return ' '.join([format_pose(record.stamp, record.T_odom_camera),
                     *(f'{value:.12e}' for value in covariance[_LOWER])])


def _text(header: Iterable[str], lines: Iterable[str]) -> str:
    return '\n'.join([*header, *lines]) + '\n'
