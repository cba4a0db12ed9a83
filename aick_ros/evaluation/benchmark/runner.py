# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs the methods of a benchmark on its recordings, several processes at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

from aick_ros.evaluation.baselines.registry import Method
from aick_ros.evaluation.benchmark.journal import Journal, Line, PairLine
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.benchmark.supervisor import Job, UnusableMethodError, supervise
from aick_ros.evaluation.scores.frame_pairs import FramePair


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
        runs = len(self.methods) + len(self.variants)
        return runs * sum(map(len, self.pairs.values()))

    def jobs(self, journal: Journal) -> list[Job]:
        """Return the jobs for all pairs that the journal does not have."""
        jobs = []
        for method in (*self.methods, *self.variants):
            for recording in self.recordings:
                done = journal.pairs.get((method.identity, recording.name), {})
                pairs = [pair for pair in self.pairs[recording.name] if pair not in done]
                if pairs:
                    jobs.append(Job(method, recording, pairs))
        return jobs


def run(plan: Plan, journal: Journal, processes: int, time_limit: float,
        on_progress: Callable[[int], None], is_stopped: Callable[[], bool]) -> dict[str, str]:
    """
    Register all pairs that the journal does not have.

    :param processes: number of methods that run at a time; more than one distorts the times.
    :param time_limit: longest time for a frame or a pair [s].
    :param on_progress: called with the number of pairs done.
    :param is_stopped: called several times a second; the rest is left for the next run.
    :returns: name of each method that did not start -> the reason.
    """
    jobs = plan.jobs(journal)
    done = plan.registrations - sum(len(job.pairs) for job in jobs)
    unusable: dict[str, str] = {}

    def record(line: Line) -> None:
        nonlocal done
        journal.add(line)
        if isinstance(line, PairLine):
            done += 1
            on_progress(done)

    def do(job: Job) -> None:
        if is_stopped() or job.method.name in unusable:
            return
        try:
            supervise(job, time_limit, record, is_stopped)
        except UnusableMethodError as error:
            unusable[job.method.name] = str(error)

    on_progress(done)
    with ThreadPoolExecutor(processes) as pool:
        for future in [pool.submit(do, job) for job in jobs]:
            future.result()
    return unusable
