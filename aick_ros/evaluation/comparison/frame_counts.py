# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that only one of two runs of a recording has, and the sentence that names them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class FrameCounts:
    """
    Numbers of frames of two runs of a recording; the fields are keys of the JSON.

    :param baseline: of the run of the baseline.
    :param candidate: of the run of the candidate.
    :param common: of those that have the same stamps in both; only these are compared.
    """

    baseline: int
    candidate: int
    common: int

    @classmethod
    def of(cls, baseline: frozenset[int], candidate: frozenset[int]) -> FrameCounts:
        """Return the numbers from the stamps of both runs."""
        return cls(len(baseline), len(candidate), len(baseline & candidate))

    @property
    def swapped(self) -> FrameCounts:
        """The same counts, with the candidate as the baseline."""
        return FrameCounts(self.candidate, self.baseline, self.common)

    @property
    def lacking(self) -> int:
        """Number of frames of the baseline that the candidate lacks."""
        return self.baseline - self.common


def missing(frames: Mapping[str, FrameCounts], only_baseline: Sequence[str], baseline: str,
            candidate: str, most: int | None = None) -> list[str]:
    """
    Return a sentence each on the recordings and the frames that the candidate lacks, if it does.

    :param frames: name of the recording -> numbers of frames.
    :param only_baseline: recordings of which the candidate has no run.
    :param baseline: what the baseline is called.
    :param candidate: what the candidate is called.
    :param most: number of recordings that a sentence names; None: all.
    """
    sentences = []
    if only_baseline:
        sentences.append(f'{candidate} has no run of {_listed(only_baseline, most)}: not compared')
    lacking = [f'{counts.lacking} of {counts.baseline} of {name}'
               for name, counts in frames.items() if counts.lacking]
    if lacking:
        sentences.append(f'{candidate} lacks frames that {baseline} has, '
                         f'{_listed(lacking, most)}: only frames of both are compared')
    return sentences


def _listed(items: Sequence[str], most: int | None) -> str:
    more = [] if most is None or len(items) <= most else [f'and {len(items) - most} more']
    return ', '.join([*items[:most], *more])
