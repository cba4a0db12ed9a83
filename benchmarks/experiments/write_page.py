# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Writes docs/experiments.md and its pictures from the JSON of ``aick benchmark``.

    python benchmarks/experiments/write_page.py

The text is that of page.md beside this file, with everything in double braces filled in: the
tables by name, and single figures: {{ratio METHOD GAP THRESHOLD}} and {{ms METHOD}}, one for each
recording; {{every METHOD GAP}}, success within 0.01 m on all pairs of all recordings;
{{times METHOD OTHER COUNTED}}, how many times as long another one takes. The results are the JSON
files in results/, which run.sh makes.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from paper import TABLE_1
from share import Share

from aick_ros.evaluation.benchmark.figures import paper_figures
from aick_ros.reports.benchmark_plots import write_figures

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))
from markdown_page import fill, joined, machine, number, ratio, table  # noqa: E402

DOCS = HERE.parents[1] / 'docs'
IMAGES = 'images/experiments'


class Page:
    """
    Fills in the text.

    :param results: of the run with all methods but the slowest.
    :param slow: of the run with few pairs, which has the slowest too.
    :param every: of the run with all pairs.
    :param sweeps: of the run with varied settings, and the walk along rendered shelves.
    """

    def __init__(self, results: dict[str, Any], slow: dict[str, Any], every: dict[str, Any],
                 sweeps: dict[str, Any]) -> None:
        self._results, self._slow, self._every, self._sweeps = results, slow, every, sweeps
        self._contents: dict[str, Callable[..., str]] = {
            'table 1': self._table_1, 'table slow': self._table_slow,
            'table gaps': self._table_gaps, 'table settings': self._table_settings,
            'table every': self._table_every,
            'machine': lambda: machine(self._results), 'pictures': self._pictures,
            'recordings': self._recordings,
            'pairs': lambda: str(self._most_pairs(self._results)),
            'pairs slow': lambda: str(self._most_pairs(self._slow)),
            'pairs sweeps': lambda: str(self._most_pairs(self._sweeps)),
            'corridor': self._corridor, 'ratio': self._ratio, 'ms': self._milliseconds,
            'times': self._times,
            'every': lambda method, gap: str(self._share(method, gap)),
            'trials': lambda method, gap: str(self._share(method, gap).trials)}

    def fill(self, text: str) -> str:
        """
        Return the text with everything filled in.

        :raises InputError: for braces that stand for nothing.
        """
        return fill(text, self._contents)

    def _table_1(self) -> str:
        """Return the rows of methods, ours beside the paper's."""
        names = list(self._results['recordings'])
        rows = [('method', 'one registration [ms]', 'with its two frames [ms]', *names,
                 "paper's [ms]", 'fr1/room', 'paper / ours')]
        for method in self._in_order(self._results):
            paper = TABLE_1.get(method)
            ours = self._p50(self._results, method)
            rows.append((
                f'`{method}`', number(ours), number(self._whole(self._results, method)),
                *(_triple(self._pair(self._results, method, name, 1)) for name in names),
                number(1e3 * paper.seconds) if paper else '',
                ' / '.join(ratio(share) for share in paper.success) if paper else '',
                _factor(1e3 * paper.seconds / ours) if paper else ''))
        return table(rows)

    def _table_slow(self) -> str:
        names, gaps = list(self._slow['recordings']), self._gaps(self._slow)
        rows = [('method', 'one registration [ms]', *(f'{name}, gap {gap}' for name in names
                                                      for gap in gaps), "paper's [ms]",
                 'paper / ours')]
        for method in self._in_order(self._slow):
            ours, paper = self._p50(self._slow, method), TABLE_1[method]
            rows.append((
                f'`{method}`', number(ours),
                *(ratio(self._pair(self._slow, method, name, gap)['success_ratio']['0.01'])
                  for name in names for gap in gaps),
                number(1e3 * paper.seconds), _factor(1e3 * paper.seconds / ours)))
        return table(rows)

    def _table_gaps(self) -> str:
        """Return success within 0.01 m over the gap, and times, for each recording."""
        gaps, parts = self._gaps(self._results), []
        for name in self._results['recordings']:
            rows = [(name, *(f'gap {gap}' for gap in gaps), 'failed', 'registration [ms]',
                     'a frame before [ms]')]
            for method in self._in_order(self._results):
                score = self._results['methods'][method][name]
                pairs = [score['pairs'][gap] for gap in gaps]
                rows.append((
                    f'`{method}`', *(ratio(pair['success_ratio']['0.01']) for pair in pairs),
                    str(sum(pair['failed'] for pair in pairs)),
                    number(pairs[0]['registration_ms']['p50']),
                    number(score['preparation_ms']['p50'])))
            parts.append(table(rows))
        return '\n\n'.join(parts)

    def _table_every(self) -> str:
        """Return success within 0.01 m on all pairs, of each recording and of all together."""
        names, gaps = list(self._every['recordings']), self._gaps(self._every)
        rows = [('method', *(f'{name}, gap {gap}' for gap in gaps for name in (*names, 'both')))]
        for method in self._in_order(self._every):
            cells = []
            for gap in gaps:
                pairs = [self._pair(self._every, method, name, gap) for name in names]
                cells += [ratio(pair['success_ratio']['0.01']) for pair in pairs]
                cells.append(str(self._share(method, gap)))
            rows.append((f'`{method}`', *cells))
        return table(rows)

    def _table_settings(self) -> str:
        settings = {method: text for results in (self._results, self._every, self._slow)
                    for method, text in results['settings'].items()}
        return table([('method', 'settings'), *((f'`{method}`', text)
                                                for method, text in settings.items())])

    def _recordings(self) -> str:
        return ' and '.join(
            f'{name} ({facts["frames"]} frames, {facts["period_ms"]:.0f} ms apart)'
            for name, facts in self._results['recordings'].items())

    def _corridor(self) -> str:
        end = self._sweeps['corridor']
        share = 100 * end['error_m'] / end['length_m']
        return (f'{end["frames"]:,} frames, {end["length_m"]:.1f} m, off at the end by '
                f'{end["error_m"]:.2f} m ({share:.1f} % of the way) and '
                f'{end["error_deg"]:.1f} deg, {end["failed"]} registrations failed')

    def _pictures(self) -> str:
        parts = []
        for name, figure in all_figures(self._results, self._sweeps).items():
            paper, _, ours = name.partition('-')
            title = f'{"Beside figure" if ours else "Figure"} {paper}: {figure["title"]}'
            parts.append(f'![{title}]({IMAGES}/figure-{name}.png)')
        return '\n\n'.join(parts)

    def _ratio(self, method: str, gap: str, threshold: str) -> str:
        results = self._of(method)
        return joined(ratio(self._pair(results, method, name, gap)['success_ratio'][threshold])
                      for name in results['recordings'])

    def _milliseconds(self, method: str) -> str:
        results = self._of(method)
        return joined(number(self._pair(results, method, name, 1)['registration_ms']['p50'])
                      for name in results['recordings'])

    def _times(self, method: str, other: str, counted: str = 'registration') -> str:
        """
        Return how many times as long another method takes, in the same run.

        :param counted: 'registration' alone, 'whole' with what both do of the two frames, or
            'paper', which takes that of the other and not of the first.
        """
        results = self._of(other)
        measures = {'registration': (self._p50, self._p50), 'whole': (self._whole, self._whole),
                    'paper': (self._p50, self._whole)}
        ours, theirs = measures[counted]
        return _factor(theirs(results, other) / ours(results, method))

    def _share(self, method: str, gap: str) -> Share:
        """Return the successes within 0.01 m of all pairs of all recordings."""
        pairs = [self._pair(self._every, method, name, gap) for name in self._every['recordings']]
        return Share(sum(round(pair['count'] * pair['success_ratio']['0.01']) for pair in pairs),
                     sum(pair['count'] for pair in pairs))

    def _of(self, method: str) -> dict[str, Any]:
        return self._results if method in self._results['methods'] else self._slow

    def _in_order(self, results: dict[str, Any]) -> list[str]:
        """Return the methods that were run, the paper's first."""
        found = list(results['methods'])
        return [*(name for name in TABLE_1 if name in found),
                *(name for name in found if name not in TABLE_1)]

    def _p50(self, results: dict[str, Any], method: str) -> float:
        """Return the median of one registration at gap 1 [ms], the mean of the recordings."""
        times = [self._pair(results, method, name, 1)['registration_ms']['p50']
                 for name in results['recordings']]
        return sum(times) / len(times)

    def _whole(self, results: dict[str, Any], method: str) -> float:
        """Return the median of one registration and twice that of a frame before it [ms]."""
        frames = [results['methods'][method][name]['preparation_ms']['p50']
                  for name in results['recordings']]
        return self._p50(results, method) + 2 * sum(frames) / len(frames)

    @staticmethod
    def _pair(results: dict[str, Any], method: str, recording: str, gap: int | str) -> dict:
        return results['methods'][method][recording]['pairs'][str(gap)]

    @staticmethod
    def _most_pairs(results: dict[str, Any]) -> int:
        return max(count for facts in results['recordings'].values()
                   for count in facts['pairs'].values())

    @staticmethod
    def _gaps(results: dict[str, Any]) -> list[str]:
        return list(next(iter(results['recordings'].values()))['pairs'])


def _triple(pair: dict[str, Any]) -> str:
    return joined(ratio(share) for share in pair['success_ratio'].values())


def _factor(value: float) -> str:
    return f'{number(value)} x'


def all_figures(*results: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of runs in the paper's order; the first run that has one gives it."""
    figures: dict[str, Any] = {}
    for run in results:
        figures = {**run['figures'], **figures}
    return {figure.number: figures[figure.number] for figure in paper_figures(Path())
            if figure.number in figures}


def read_results() -> list[dict[str, Any]]:
    """Return the results of the runs, as :class:`Page` takes them."""
    return [json.loads((HERE / 'results' / f'{name}.json').read_text())
            for name in ('experiments', 'slow', 'every', 'sweeps')]


def page_text() -> str:
    """Return docs/experiments.md."""
    return Page(*read_results()).fill((HERE / 'page.md').read_text())


def main() -> None:
    """Write the page and the pictures."""
    (DOCS / 'experiments.md').write_text(page_text())
    (DOCS / IMAGES).mkdir(exist_ok=True, parents=True)
    results, *_, sweeps = read_results()
    write_figures(all_figures(results, sweeps), results['recordings'], DOCS / IMAGES)
    walked = HERE / 'results' / 'plots' / 'figure-10.png'
    if walked.is_file():  # its points are too many for the JSON
        shutil.copy(walked, DOCS / IMAGES)


if __name__ == '__main__':
    main()
