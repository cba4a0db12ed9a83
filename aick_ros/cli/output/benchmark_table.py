# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Results of ``aick benchmark`` on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from aick_ros.borders.names import counted
from aick_ros.cli.output.console import decimal, say, table
from aick_ros.cli.output.missing_pairs import without_pairs
from aick_ros.evaluation.benchmark.results import MethodScore, Results

_PROBLEMS = ('crashed', 'took longer', 'given up', 'raised', 'a frame could not be prepared')


def show_results(results: Results, on_stderr: bool) -> None:
    """
    Print a table per recording, and a line for what it lacks: gaps, pairs, methods.

    :param on_stderr: print on standard error, where JSON goes to standard output.
    """
    for recording, facts in results.recordings.items():
        gaps = [gap for gap, count in facts['pairs'].items() if count]
        columns = ('method', 'gap', 'pairs', 'failed', 'within\n3.3 mm', '10 mm', '50 mm',
                   'p50\n[ms]', 'p99\n[ms]', 'per frame\n[ms]')
        rows = (row for method, scores in results.methods.items()
                for row in _rows(method, scores[recording], gaps))
        table(f'{recording}: {counted(facts["frames"], "frame")}', rows, columns, on_stderr)
        missing = [int(gap) for gap in facts['pairs'] if gap not in gaps]
        if missing:
            say(without_pairs(recording, facts['frames'], missing))
    for method, scores in results.methods.items():
        for recording, score in scores.items():
            for failure, count in score.failures.items():
                if failure.startswith(_PROBLEMS):
                    say(f'{method} on {recording}: {counted(count, "pair")} failed: {failure}')
    for method, reason in results.not_run.items():
        say(f'{method} was not run: {reason}')


def _rows(method: str, score: MethodScore, gaps: Sequence[str]) -> Iterator[tuple[str, ...]]:
    for gap in gaps:
        pair = score.pairs[gap]
        first = gap == gaps[0]
        yield (method if first else '', gap, str(pair.count), str(pair.failed),
               *(decimal(ratio) for ratio in pair.success_ratio.values()),
               decimal(pair.registration_ms.p50, digits=2),
               decimal(pair.registration_ms.p99, digits=2),
               decimal(score.preparation_ms.p50, digits=1) if first else '')
