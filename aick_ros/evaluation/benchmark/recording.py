# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings of a benchmark, and the pairs of frames that every method registers."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.frame_pairs import FramePair, countable_pairs, median_period
from aick_ros.evaluation.scores.ground_truth import true_motion
from aick_ros.frames.mask import ImageMask, MaskedFrame, mask_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.settings import SensorSettings
from aick_ros.sources import OnDamaged, RgbdSource, SourceOptions, is_rendered, open_source


@dataclass(frozen=True)
class Request:
    """
    Which frames of a recording to read, and how; pickled for worker processes.

    :param path: as :func:`aick_ros.sources.open_source` takes it.
    :param limit: maximum number of frames; None: all.
    :param max_interval: largest difference of the stamps of a colour and a depth image [s].
    :param register_depth: as :class:`aick_ros.sources.SourceOptions` has it, and the next two.
    :param mask: as the parameter ``sensor.mask`` has it.
    """

    path: str
    limit: int | None = None
    max_interval: float = SourceOptions.max_interval
    register_depth: bool = False
    depth_info_topic: str | None = None
    depth_in_colour: Sequence[float] | None = None
    mask: str = ''

    @property
    def options(self) -> SourceOptions:
        """Options with which the recording is read."""
        return SourceOptions(
            max_interval=self.max_interval, register_depth=self.register_depth,
            depth_info_topic=self.depth_info_topic, depth_in_colour=self.depth_in_colour)

    def open(self) -> RgbdSource:
        """Return the source."""
        return open_source(self.path, self.options)

    def with_absolute_path(self) -> Request:
        """Return the request that reads the same in a process that works in another folder."""
        if is_rendered(self.path):
            return self
        return dataclasses.replace(self, path=os.path.abspath(self.path))


@dataclass(frozen=True, eq=False)
class Recording:
    """
    A recording with ground truth whose stamps have been read.

    :param stamps: of all frames that can be used [ns].
    :param mask: hides a part of the frames from all methods; None: they see all.
    """

    name: str
    request: Request
    stamps: tuple[int, ...]
    ground_truth: Trajectory
    mask: ImageMask | None = None

    @classmethod
    def scan(cls, request: Request, on_progress: Callable[[int], None],
             on_damaged: OnDamaged) -> Recording:
        """
        Read the stamps of a source, and the mask.

        :raises InputError: where it has no ground truth, or fewer than two frames, or where the
            mask cannot be read or does not fit them.
        """
        source = request.open()
        mask = mask_of(SensorSettings(mask=request.mask), '--mask')
        if source.ground_truth is None:
            raise InputError(f'{source.name} has no ground truth, which a benchmark requires: '
                             'remove it from the command')
        stamps: list[int] = []
        for frame in islice(source.frames(on_damaged), request.limit):
            if mask is not None and not stamps:
                mask.applied(frame)
            stamps.append(frame.stamp)
            on_progress(len(stamps))
        if len(stamps) < 2:
            raise InputError(f'{source.name} has {len(stamps)} usable frames: at least 2 are '
                             'required')
        return cls(source.name, request.with_absolute_path(), tuple(stamps), source.ground_truth,
                   mask)

    def shown(self, frame: RgbdFrame) -> RgbdFrame:
        """Return a frame of the recording as all methods see it."""
        masked = frame if self.mask is None else self.mask.applied(frame)
        return masked.without_colour() if isinstance(masked, MaskedFrame) else masked

    @property
    def period(self) -> float:
        """Median time between consecutive frames [ns]."""
        return median_period(self.stamps)

    def pairs(self, gaps: Sequence[int], most: int | None = None) -> list[FramePair]:
        """
        Return the pairs that count (:func:`.countable_pairs`).

        :param most: maximum number of pairs per gap, evenly spaced among all; None: all.
        """
        chosen = []
        for gap in gaps:
            pairs = countable_pairs(self.stamps, self.ground_truth, gap)
            if most is not None and len(pairs) > most:
                indices = np.linspace(0, len(pairs) - 1, most).round().astype(int)
                pairs = [pairs[index] for index in indices]
            chosen += pairs
        return chosen

    def error(self, pair: FramePair, T_target_source: np.ndarray) -> tuple[float, float]:
        """
        Return the translation error [m] and the rotation error [rad] of a transform (Eq. 3).

        :param pair: one of :meth:`pairs`.
        """
        true_T_target_source = true_motion(self.ground_truth, self.stamps[pair.target],
                                           self.stamps[pair.source])
        if true_T_target_source is None:
            raise ValueError(f'the ground truth of {self.name} does not cover {pair}')
        error = se3.inverse(true_T_target_source) @ T_target_source
        return float(np.linalg.norm(error[:3, 3])), se3.angle(error[:3, :3])
