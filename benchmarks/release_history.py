# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figures that were measured at releases, and what got worse since the last one."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Figure:
    """
    A figure over several runs.

    :param value: median of the runs.
    :param noise: largest less smallest of the runs.
    """

    value: float
    noise: float

    @classmethod
    def of(cls, runs: Sequence[float]) -> Figure:
        """Return that of some runs."""
        return cls(float(np.median(runs)), max(runs) - min(runs))


def summary(runs: Sequence[Mapping[str, float]]) -> dict[str, Figure]:
    """Return each figure over the runs."""
    return {name: Figure.of([run[name] for run in runs]) for name in runs[0]}


def worse(now: Mapping[str, Figure], then: Mapping[str, Figure],
          larger_is_better: Collection[str] = ()) -> list[str]:
    """Return the figures that got worse by more than their noise, then and now, in words."""
    found = []
    for name in now.keys() & then.keys():
        change = now[name].value - then[name].value
        loss = -change if name in larger_is_better else change
        if loss > now[name].noise + then[name].noise:
            found.append(f'{name} got worse: {then[name].value:.3g} -> {now[name].value:.3g}')
    return sorted(found)


def figures_of(entry: Mapping[str, Any] | None, kind: str) -> dict[str, Figure]:
    """Return the figures of an entry of a history; none without an entry."""
    return {} if entry is None else {
        name: Figure(**figure) for name, figure in entry[kind].items()}


def last_release(history: Sequence[Mapping[str, Any]], cpu: str) -> Mapping[str, Any] | None:
    """Return the last entry of a history; of this processor, where it has any."""
    same = [entry for entry in history if entry['machine']['cpu'] == cpu]
    return (same or list(history) or [None])[-1]


def release_line(then: Mapping[str, Any], machine: Mapping[str, Any]) -> str:
    """Return which release is compared with."""
    other = '' if then['machine']['cpu'] == machine['cpu'] else ', another processor'
    return f'released: {then["release"]}, {then["date"]}{other}'


def record(file: Path, release: str, machine: Mapping[str, Any], kind: str,
           found: Mapping[str, Figure]) -> None:
    """Add the figures of a release to a history."""
    history = json.loads(file.read_text())
    history.append({'release': release, 'date': date.today().isoformat(), 'machine': machine,
                    kind: {name: {'value': round(figure.value, 4),
                                  'noise': round(figure.noise, 4)}
                           for name, figure in found.items()}})
    file.write_text(f'{json.dumps(history, indent=1)}\n')


def write_json(file: str, machine: Mapping[str, Any], kind: str,
               found: Mapping[str, Figure]) -> None:
    """Write the figures of a run; - is standard output."""
    text = json.dumps({'machine': machine, kind: {
        name: figure.value for name, figure in found.items()}}, indent=1)
    print(text) if file == '-' else Path(file).write_text(f'{text}\n')
