# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Writes docs/experiments.md and its pictures from the JSON of ``aick benchmark``.

    python benchmarks/experiments/write_page.py

The text is that of page.md beside this file, with everything in double braces filled in: the
tables by name, and single figures as {{ratio METHOD GAP THRESHOLD}}, {{ms METHOD}} and
{{times METHOD OTHER}}, one for each recording. The results are the JSON files in results/.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from paper import TABLE_1

from aick_ros.errors import InputError
from aick_ros.reports.benchmark_plots import write_figures

HERE = Path(__file__).resolve().parent
DOCS = HERE.parents[1] / 'docs'
IMAGES = 'images/experiments'


class Page:
    """
    Fills in the text.

    :param results: of the run with many pairs.
    :param slow: of the run with few pairs, which has the paper's slow methods too.
    :param walk: of the run along rendered shelves.
    """

    def __init__(self, results: dict[str, Any], slow: dict[str, Any],
                 walk: dict[str, Any]) -> None:
        self._results, self._slow, self._walk = results, slow, walk
        self._tables: dict[str, Callable[[], str]] = {
            'table 1': self._table_1, 'table slow': self._table_slow,
            'table gaps': self._table_gaps, 'table settings': self._table_settings,
            'machine': self._machine, 'pictures': self._pictures,
            'recordings': self._recordings,
            'pairs': lambda: str(self._most_pairs(self._results)),
            'pairs slow': lambda: str(self._most_pairs(self._slow)),
            'corridor': self._corridor,
            'methods': lambda: ','.join(self._results['methods']),
            'methods slow': lambda: ','.join(self._slow['methods']),
            'gaps': lambda: ','.join(self._gaps(self._results)),
            'gaps slow': lambda: ','.join(self._gaps(self._slow))}
        self._figures: dict[str, Callable[..., str]] = {
            'ratio': self._ratio, 'ms': self._milliseconds, 'times': self._times}

    def fill(self, text: str) -> str:
        """
        Return the text with everything filled in.

        :raises InputError: for braces that stand for nothing.
        """
        return re.sub(r'\{\{(.+?)\}\}', lambda match: self._content(match[1]), text)

    def _content(self, name: str) -> str:
        if name in self._tables:
            return self._tables[name]()
        kind, *arguments = name.split()
        try:
            return self._figures[kind](*arguments)
        except (KeyError, TypeError):
            raise InputError(f'{{{{{name}}}}} stands for nothing that was measured') from None

    def _table_1(self) -> str:
        """Return the rows of methods, ours beside the paper's."""
        names = list(self._results['recordings'])
        rows = [('method', 'one registration [ms]', *names, "paper's [ms]", 'fr1/room',
                 'paper / ours')]
        for method in self._in_order(self._results):
            paper = TABLE_1.get(method)
            ours = self._p50(self._results, method)
            rows.append((
                f'`{method}`', _number(ours),
                *(_triple(self._pair(self._results, method, name, 1)) for name in names),
                _number(1e3 * paper.seconds) if paper else '',
                ' / '.join(_ratio(ratio) for ratio in paper.success) if paper else '',
                _factor(1e3 * paper.seconds / ours) if paper else ''))
        return _table(rows)

    def _table_slow(self) -> str:
        names, gaps = list(self._slow['recordings']), self._gaps(self._slow)
        rows = [('method', 'one registration [ms]', *(f'{name}, gap {gap}' for name in names
                                                      for gap in gaps), "paper's [ms]",
                 'paper / ours')]
        for method in self._in_order(self._slow):
            ours, paper = self._p50(self._slow, method), TABLE_1[method]
            rows.append((
                f'`{method}`', _number(ours),
                *(_ratio(self._pair(self._slow, method, name, gap)['success_ratio']['0.01'])
                  for name in names for gap in gaps),
                _number(1e3 * paper.seconds), _factor(1e3 * paper.seconds / ours)))
        return _table(rows)

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
                    f'`{method}`', *(_ratio(pair['success_ratio']['0.01']) for pair in pairs),
                    str(sum(pair['failed'] for pair in pairs)),
                    _number(pairs[0]['registration_ms']['p50']),
                    _number(score['preparation_ms']['p50'])))
            parts.append(_table(rows))
        return '\n\n'.join(parts)

    def _table_settings(self) -> str:
        settings = {**self._results['settings'], **self._slow['settings']}
        return _table([('method', 'settings'), *((f'`{method}`', text)
                                                 for method, text in settings.items())])

    def _machine(self) -> str:
        facts = self._results['machine']
        return (f'{self._results["date"]}, {facts["cpu"]}, {facts["cores"]} cores, '
                f'{facts["system"]}, Python {facts["python"]}, NumPy {facts["numpy"]}, OpenCV '
                f'{facts["opencv"]}, aick_ros {facts["aick_ros"]}')

    def _recordings(self) -> str:
        return ' and '.join(
            f'{name} ({facts["frames"]} frames, {facts["period_ms"]:.0f} ms apart)'
            for name, facts in self._results['recordings'].items())

    def _corridor(self) -> str:
        end = self._walk['corridor']
        share = 100 * end['error_m'] / end['length_m']
        return (f'{end["frames"]:,} frames, {end["length_m"]:.1f} m, off at the end by '
                f'{end["error_m"]:.2f} m ({share:.1f} % of the way) and '
                f'{end["error_deg"]:.1f} deg, {end["failed"]} registrations failed')

    def _pictures(self) -> str:
        parts = []
        for number, figure in self._results['figures'].items():
            paper, _, ours = number.partition('-')
            title = f'{"Beside figure" if ours else "Figure"} {paper}: {figure["title"]}'
            parts.append(f'![{title}]({IMAGES}/figure-{number}.png)')
        return '\n\n'.join(parts)

    def _ratio(self, method: str, gap: str, threshold: str) -> str:
        results = self._of(method)
        return _joined(_ratio(self._pair(results, method, name, gap)['success_ratio'][threshold])
                       for name in results['recordings'])

    def _milliseconds(self, method: str) -> str:
        results = self._of(method)
        return _joined(_number(self._pair(results, method, name, 1)['registration_ms']['p50'])
                       for name in results['recordings'])

    def _times(self, method: str, other: str) -> str:
        """Return how many times as long another method takes, in the same run."""
        results = self._of(other)
        return _factor(self._p50(results, other) / self._p50(results, method))

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


def _table(rows: Sequence[Sequence[str]]) -> str:
    lines = [f'| {" | ".join(row)} |' for row in rows]
    return '\n'.join([lines[0], '|' + '---|' * len(rows[0]), *lines[1:]])


def _joined(figures: Iterator[str]) -> str:
    return ' / '.join(figures)


def _triple(pair: dict[str, Any]) -> str:
    return _joined(_ratio(ratio) for ratio in pair['success_ratio'].values())


def _ratio(ratio: float | None) -> str:
    return '-' if ratio is None else f'{ratio:.2f}'


def _number(value: float | None) -> str:
    """Return three significant digits."""
    if value is None:
        return '-'
    return f'{value:,.0f}' if value >= 100 else f'{value:.3g}'


def _factor(value: float) -> str:
    return f'{_number(value)} x'


def read_results() -> list[dict[str, Any]]:
    """Return the results of the three runs."""
    return [json.loads((HERE / 'results' / f'{name}.json').read_text())
            for name in ('experiments', 'slow', 'corridor')]


def page_text() -> str:
    """Return docs/experiments.md."""
    return Page(*read_results()).fill((HERE / 'page.md').read_text())


def main() -> None:
    """Write the page and the pictures."""
    (DOCS / 'experiments.md').write_text(page_text())
    (DOCS / IMAGES).mkdir(exist_ok=True, parents=True)
    results, *_ = read_results()
    write_figures(results['figures'], results['recordings'], DOCS / IMAGES)
    walked = HERE / 'results' / 'plots' / 'figure-10.png'
    if walked.is_file():  # its points are too many for the JSON
        shutil.copy(walked, DOCS / IMAGES)


if __name__ == '__main__':
    main()
