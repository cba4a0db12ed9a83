# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Damaged inputs through all targets, each in a process of its own; failures are kept."""

from __future__ import annotations

import hashlib
import multiprocessing
import random
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from minimise import minimise
from mutation import Mutator
from targets import DECODERS, SEEDS
from worker import Outcome, Target, Worker, cpu_time, resident_memory

_SILENCE = 60.0  # seconds without an answer, half of them at work, of an endless input
_LONGEST_SILENCE = 600.0  # seconds without an answer of an input that waits for something
_MOST_GROWTH = 150 * 2 ** 20  # bytes that a process may hold more after a slice than at first
_CHECKED_EVERY = 500  # inputs between two looks at the memory
_MOST_KEPT = 400  # inputs with a new answer, damaged further

_FORK = multiprocessing.get_context('fork')


@dataclass
class Slice:
    """
    A part of the inputs of a target.

    :ivar count: number of inputs that were run.
    :ivar findings: name of a failure -> its input, minimised, and the text.
    """

    target: str
    count: int = 0
    findings: dict[str, tuple[bytes, str]] = field(default_factory=dict)


def seeds_of(target: str) -> list[bytes]:
    """Return the seeds of a target."""
    return [path.read_bytes() for path in sorted((SEEDS / target).iterdir())]


def run_slice(name: str, target: Target, seed: str, seconds: float, cases: int) -> Slice:
    """
    Run damaged inputs until time or number are used up.

    :param seed: the same inputs follow from the same seed.
    """
    result = Slice(name)
    with tempfile.TemporaryDirectory(prefix='aick-fuzz-') as folder:
        current = Path(folder) / 'current'
        for outcome, data in _answers(name, target, (seed, seconds, cases), current):
            result.count += 1
            kind = outcome.finding
            if kind and kind not in result.findings:
                small = minimise(data, lambda trial: _once(target, trial, kind))
                result.findings[kind] = small, outcome.text
    return result


def _answers(name: str, target: Target, plan: tuple[str, float, int],
             current: Path) -> Iterator[tuple[Outcome, bytes]]:
    """Yield what a process of its own makes of inputs, its end or silence included."""
    ours, theirs = _FORK.Pipe(duplex=False)
    process = _FORK.Process(target=_work, args=(name, target, plan, current, theirs), daemon=True)
    process.start()
    theirs.close()
    try:
        while _answered(ours, process):
            answer = ours.recv()
            if answer is None:
                return
            yield answer
        yield Outcome('endless', f'no answer within {_SILENCE:g} s'), _content(current)
    except EOFError:
        process.join()
        yield Outcome('killed', f'exit code {process.exitcode}'), _content(current)
    finally:
        process.kill()
        process.join()


def _content(current: Path) -> bytes:
    """Return the input that a process has begun last; empty where it has begun none."""
    return current.read_bytes() if current.exists() else b''


def _answered(answers: Connection, process: BaseProcess) -> bool:
    """Wait for an answer, on a busy machine too; return whether one has come."""
    for _ in range(round(_LONGEST_SILENCE / _SILENCE)):
        start = cpu_time(process.pid)
        if answers.poll(_SILENCE):
            return True
        if cpu_time(process.pid) - start > _SILENCE / 2:
            return False
    return False


def _work(name: str, target: Target, plan: tuple[str, float, int], current: Path,
          answers: Connection) -> None:
    """Run seeds, then damaged inputs; an input with a new answer is damaged further."""
    seed, seconds, cases = plan
    rng = random.Random(f'{seed} {name}')
    mutator, inputs, known = Mutator(rng), seeds_of(name), set()
    (folder := current.with_name('files')).mkdir()
    worker = Worker(target, folder, name in DECODERS)
    end = time.monotonic() + seconds
    first = resident_memory()
    for number in range(cases):
        if time.monotonic() > end:
            break
        data = (inputs[number] if number < len(seeds_of(name)) else
                mutator.mutate(rng.choice(inputs), inputs))
        current.write_bytes(data)
        outcome = worker.run(data)
        if number % _CHECKED_EVERY == _CHECKED_EVERY - 1:
            if resident_memory() - first > _MOST_GROWTH:
                outcome = Outcome('memory', f'{resident_memory() - first} bytes are held')
        if outcome.kind not in known and len(inputs) < _MOST_KEPT:
            known.add(outcome.kind)
            inputs.append(data)
        answers.send((outcome, data if outcome.finding else b''))
    answers.send(None)


def _once(target: Target, data: bytes, kind: str) -> bool:
    """Return whether an input fails in one way, in a process of its own."""
    if kind in ('endless', 'memory', 'slow'):
        return False  # each trial would take as long
    ours, theirs = _FORK.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(prefix='aick-fuzz-') as folder:
        process = _FORK.Process(target=_trial, args=(target, data, Path(folder), theirs),
                                daemon=True)
        process.start()
        theirs.close()
        try:
            found = ours.recv() if ours.poll(_SILENCE) else 'endless'
        except EOFError:
            found = 'killed'
        process.kill()
        process.join()
    return bool(found == kind)


def _trial(target: Target, data: bytes, folder: Path, answer: Connection) -> None:
    answer.send(Worker(target, folder).run(data).finding)


def keep(findings: Sequence[Slice], folder: Path) -> list[Path]:
    """Write each failing input, and what it caused, into a folder of its target."""
    paths = []
    for part in findings:
        for kind, (data, text) in part.findings.items():
            path = folder / part.target / f'{kind}-{hashlib.sha256(data).hexdigest()[:8]}'
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            path.with_name(f'{path.name}.txt').write_text(text)
            paths.append(path)
    return paths
