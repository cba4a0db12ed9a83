# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What ``aick fleet`` gains and costs, and what it loses when its processes are killed.

    python benchmarks/fleet.py SOURCE [--recordings 12] [--frames 300] [--tiny 10000]

SOURCE is a recording with ground truth; the fleet consists of links to it. It is run by two
processes and compared with the same runs one after the other in this process, which has one
thread as theirs have, and with ``aick evaluate``, which reads ahead in a second one and so uses
more than one core itself. Then it is run again while workers are killed with SIGKILL at random
moments, and once the command with its scheduler, which is then given again; at last on many
recordings of two rendered frames. What two processes can gain on this machine, whose cores share
the memory, is shown by two without the engine.

Python keeps the bytecode that it compiles, as pip does for what it installs.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import psutil
from row import HEAD, Row

from aick_ros.borders.allocator import keep_freed_memory
from aick_ros.cli.fleet.job import Job, run_job
from aick_ros.cli.input.reading import Reading
from aick_ros.evaluation.runs.table import Row as Cells
from aick_ros.evaluation.runs.table import read_table
from aick_ros.evaluation.scores.evaluation import evaluate
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.geometry.camera import Camera
from aick_ros.settings import Settings
from aick_ros.sources import open_source
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

WORKERS = 2
KILLS = 5
SMALL = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
MEASURED_ANEW = ('_ms', 'wall_time', 'peak_memory')
"""Parts of the names of figures that differ from run to run."""


class Fleet:
    """The command on a folder of recordings, as a process."""

    def __init__(self, recordings: Path, out: Path, frames: int) -> None:
        self.out = out
        self._process = psutil.Popen(
            [sys.executable, '-m', 'aick_ros', 'fleet', str(recordings), '--out', str(out),
             '--workers', str(WORKERS), '--limit', str(frames), '--no-dashboard'],
            stdout=subprocess.DEVNULL)

    @property
    def is_running(self) -> bool:
        """Running state of the command."""
        return self._process.poll() is None

    @property
    def memory(self) -> float:
        """Memory of the client and the scheduler, which are one process [MB]."""
        try:
            return float(self._process.memory_info().rss / 1e6)
        except psutil.NoSuchProcess:
            return 0.0

    @property
    def workers(self) -> list[psutil.Process]:
        """Processes that run tasks; the server that forks them is their parent."""
        return [process for server in self._process.children() for process in server.children()]

    def kill(self) -> None:
        """Kill the command, its scheduler with it, and wait for the end of its workers."""
        orphans = self.workers
        self._process.kill()
        self._process.wait()
        if psutil.wait_procs(orphans, timeout=60.0)[1]:
            raise RuntimeError('workers go on without the command')

    def rows(self) -> list[Cells]:
        """Return the table once the command has ended."""
        self._process.wait()
        return read_table(self.out / 'table.parquet')


def links(source: Path, folder: Path, count: int) -> Path:
    """Return a folder with as many links to a recording."""
    folder.mkdir()
    for number in range(count):
        recording = folder / f'{source.name}_{number:05}'
        recording.mkdir()
        for entry in source.resolve().iterdir():
            (recording / entry.name).symlink_to(entry)
    return folder


def jobs_of(recordings: Path, frames: int) -> list[Job]:
    """Return the runs of the recordings of a folder."""
    return [Job(str(path), '', Settings(), limit=frames) for path in sorted(recordings.iterdir())]


def one_after_the_other(recordings: Path, frames: int) -> tuple[float, list[Cells]]:
    """Return the time of the runs in this process [s], and the figures."""
    start = time.monotonic()
    figures = [run_job(job).figures for job in jobs_of(recordings, frames)]
    return time.monotonic() - start, figures


def reading_ahead(recordings: Path, frames: int) -> tuple[float, float]:
    """Return the time of ``aick evaluate`` after its start for all [s], and its busy cores."""
    start, used = time.monotonic(), time.process_time()
    for job in jobs_of(recordings, frames):
        reading = Reading(open_source(job.source, job.options), job.limit)
        evaluate(reading, job.settings, job.gaps)
    seconds = time.monotonic() - start
    return seconds, (time.process_time() - used) / seconds


def without_engine(recordings: Path, frames: int) -> float:
    """Return the time of the runs in two processes that do nothing else [s]."""
    jobs = jobs_of(recordings, frames)
    with ProcessPoolExecutor(WORKERS, get_context('forkserver'), keep_freed_memory) as processes:
        start = time.monotonic()
        list(processes.map(run_job, jobs))
    return time.monotonic() - start


def keep_bytecode(folder: Path) -> None:
    """Let processes that are started from here on keep what they compile in a folder."""
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    os.environ['PYTHONPYCACHEPREFIX'] = str(folder)


def differing(expected: Sequence[Cells], found: Sequence[Cells]) -> int:
    """Return the number of figures that are not equal to the last digit."""
    return sum(row.get(name) != value for figures, row in zip(expected, found, strict=True)
               for name, value in figures.items()
               if not any(part in name for part in MEASURED_ANEW))


def killed(recordings: Path, out: Path, frames: int, seconds: float) -> Mapping[str, float]:
    """Return what a fleet lost whose processes were killed, of a duration without kills [s]."""
    chance = random.Random(0)
    fleet, kills = Fleet(recordings, out, frames), 0
    finished: dict[Path, int] | None = None
    while fleet.is_running:
        time.sleep(chance.uniform(0.5, 1.5) * seconds / (KILLS + 2))
        if kills < KILLS and fleet.workers:
            chance.choice(fleet.workers).kill()
            kills += 1
        elif finished is None and fleet.is_running:
            fleet.kill()
            finished = {path: path.stat().st_mtime_ns for path in out.glob('runs/*/*/row.json')}
            fleet = Fleet(recordings, out, frames)
    rows = fleet.rows()
    finished = finished or {}
    sources = {row['source'] for row in rows if row['status'] == 'done'}
    return {'kills': kills, 'missing': len(list(recordings.iterdir())) - len(sources),
            'twice': len(rows) - len({row['source'] for row in rows}), 'finished': len(finished),
            'again': sum(path.stat().st_mtime_ns != when for path, when in finished.items())}


def tiny(folder: Path, count: int) -> tuple[float, float]:
    """Return the overhead per recording of two rendered frames [ms] and the most memory [MB]."""
    write_tum(folder / 'two', SyntheticSource(SyntheticOptions(frames=2, camera=SMALL)))
    recordings = links(folder / 'two', folder / 'tiny', count)
    start, most = time.monotonic(), 0.0
    fleet = Fleet(recordings, folder / 'out_tiny', 2)
    while fleet.is_running:
        most = max(most, fleet.memory)
        time.sleep(0.05)
    seconds = time.monotonic() - start
    used = sum(float(row['wall_time_s'] or 0.0) for row in fleet.rows())
    return 1e3 * (seconds - used / WORKERS) / count, most


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('source', type=Path)
    parser.add_argument('--recordings', type=int, default=12)
    parser.add_argument('--frames', type=int, default=300)
    parser.add_argument('--tiny', type=int, default=10_000)
    given = parser.parse_args()
    keep_freed_memory()  # as the command does
    remake = (f'python benchmarks/fleet.py SOURCE --recordings {given.recordings} --frames '
              f'{given.frames} --tiny {given.tiny}')
    print(json.dumps(machine_facts()))
    print(f'\n{HEAD}')
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recordings = links(given.source, folder / 'recordings', given.recordings)
        keep_bytecode(folder / 'bytecode')
        Fleet(recordings, folder / 'first', 2).rows()
        alone, figures = one_after_the_other(recordings, given.frames)
        ahead, busy = reading_ahead(recordings, given.frames)
        start = time.monotonic()
        rows = Fleet(recordings, folder / 'out', given.frames).rows()
        together = time.monotonic() - start
        plain = without_engine(recordings, given.frames)
        show(Row(f'{WORKERS} processes against one', 1.8, True, alone / together, 'times', remake,
                 f'{alone:.0f} s, and {together:.0f} s'))
        show(Row(f'{WORKERS} processes against one that reads ahead', WORKERS / busy, True,
                 ahead / together, 'times', remake, f'{ahead:.0f} s with {busy:.2f} cores'))
        show(Row(f'{WORKERS} processes against {WORKERS} without the engine', 0.95, True,
                 plain / together, 'times', remake, f'{plain:.0f} s'))
        show(Row('figures that differ from those of one process', 0, False,
                 differing(figures, rows), '', remake, f'of {len(rows)} recordings'))
        lost = killed(recordings, folder / 'killed', given.frames, together)
        show(Row('recordings without a row after kills', 0, False, lost['missing'], '', remake,
                 f'{lost["kills"]:.0f} workers and the scheduler were killed'))
        show(Row('rows twice', 0, False, lost['twice'], '', remake))
        show(Row('finished runs done again', 0, False, lost['again'], '', remake,
                 f'of {lost["finished"]:.0f} finished'))
        overhead, memory = tiny(folder, given.tiny)
        show(Row('overhead per recording of 2 frames', 15, False, overhead, 'ms', remake))
        show(Row('memory of client and scheduler', 1000, False, memory, 'MB', remake))


def show(row: Row) -> None:
    """Print a row at once."""
    print(row, flush=True)


if __name__ == '__main__':
    main()
