# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plan of a benchmark, as tasks of the engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from aick_ros.errors import InputError
from aick_ros.evaluation.baselines.registry import Method
from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.measurement import Job, measure
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.engine.tasks import Failure, Limits, run_tasks
from aick_ros.evaluation.scores.frame_pairs import FramePair

if TYPE_CHECKING:
    from distributed import Client

_MAX_LOSSES = 4  # crashes and hangs after which the remaining pairs count as failed; chosen


@dataclass(frozen=True)
class Plan:
    """
    Methods, recordings and pairs of a benchmark.

    :param methods: installed methods.
    :param gaps: distances of the two frames of a pair.
    :param most_pairs: maximum number of pairs per gap and recording; None: all.
    :param variants: methods that only the figures need.
    """

    methods: Sequence[Method]
    recordings: Sequence[Recording]
    gaps: Sequence[int]
    most_pairs: int | None = None
    variants: Sequence[Method] = ()

    @cached_property
    def pairs(self) -> dict[str, list[FramePair]]:
        """Name of the recording -> its pairs."""
        return {recording.name: recording.pairs(self.gaps, self.most_pairs)
                for recording in self.recordings}

    @property
    def registrations(self) -> int:
        """Total number of registrations."""
        return len(self._runs) * sum(map(len, self.pairs.values()))

    @property
    def most_processes(self) -> int:
        """Number of processes of which each has something to do, at least one."""
        return max(1, len(self._runs) * len(self.recordings))

    @property
    def _runs(self) -> Sequence[Method]:
        return (*self.methods, *self.variants)

    def jobs(self, journal: Path, folder: Path, time_limit: float) -> list[Job]:
        """
        Return the job of each method and recording.

        :param folder: for their files while they run.
        """
        each = [(method, recording) for method in self._runs for recording in self.recordings]
        return [Job(method.identity, method.factory, method.options, recording,
                    self.pairs[recording.name], journal, folder / str(number), time_limit)
                for number, (method, recording) in enumerate(each)]


def run_plan(plan: Plan, journal: Journal, folder: Path, client: Client, time_limit: float,
             on_progress: Callable[[int], None], is_stopped: Callable[[], bool]
             ) -> dict[str, str]:
    """
    Register all pairs that the journal does not have.

    :param folder: an empty one, for files while the run goes on.
    :param time_limit: longest time for a frame or a pair [s].
    :param on_progress: called with the number of pairs done.
    :param is_stopped: called several times a second; the rest is left for the next run.
    :returns: name of each method that did not start -> the reason.
    :raises InputError: where a recording cannot be read any more.
    """
    def is_stopping() -> bool:
        journal.refresh()
        on_progress(min(journal.registrations, plan.registrations))
        return is_stopped()

    reasons: dict[str, str] = {}
    # a worker may have another working directory
    jobs = plan.jobs(journal.path.absolute(), folder, time_limit)
    for ended in run_tasks(client, measure, jobs, Limits(attempts=_MAX_LOSSES), is_stopping):
        job = ended.argument
        if isinstance(ended.value, Failure):
            if ended.value.cause.is_of_the_input:
                raise InputError(ended.value.reason)
            journal.refresh()
            done = journal.pairs.get((job.identity, job.recording.name), {})
            for pair in job.pairs:
                if pair not in done:
                    journal.add(job.failed(pair, f'given up: {ended.value.reason}'))
        elif ended.value:
            reasons[job.identity] = ended.value
    journal.refresh()
    return {method.name: reasons[method.identity] for method in (*plan.methods, *plan.variants)
            if method.identity in reasons}
