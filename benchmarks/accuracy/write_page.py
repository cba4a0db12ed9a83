# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Writes docs/accuracy.md and its pictures from what measure.py and ``aick benchmark`` measured.

    python benchmarks/accuracy/write_page.py

The text is that of page.md beside this file, with everything in double braces filled in:
{{figure RECORDING KEY KEY ...}} is a figure of a recording's JSON. The results are the JSON files
in results/: rivals.json of ``aick benchmark``, the others of measure.py, called after it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from goals import MEASURES, RPY, XYZ, Measure, default_of, successes
from growth_plot import growth_figure

from aick_ros.reports import canvas
from aick_ros.reports.consistency_plot import nees_figure

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))
from markdown_page import fill, joined, machine, ratio, table  # noqa: E402

DOCS = HERE.parents[1] / 'docs'
IMAGES = 'images/accuracy'
REAL = XYZ, RPY


class Page:
    """
    Fills in the text.

    :param own: recording -> the JSON of measure.py, the real ones first.
    :param rivals: the JSON of ``aick benchmark``.
    """

    def __init__(self, own: Mapping[str, Mapping[str, Any]], rivals: Mapping[str, Any]) -> None:
        self._own, self._rivals = own, rivals
        self._contents: dict[str, Callable[..., str]] = {
            'table goals': lambda: self._goals(REAL),
            'table rooms': lambda: self._goals(self._rooms()),
            'table rivals': lambda: self._beside_rivals('0.01', '1', '5', '10'),
            'table rivals fine': lambda: self._beside_rivals('0.0033', '1'),
            'table variants': self._variants, 'table skips': self._skips,
            'table shifts': self._shifts, 'table loops': self._loops,
            'table stamps': self._stamps, 'table settings': self._settings,
            'machine': lambda: machine(self._rivals), 'histograms': self._histograms,
            'methods': lambda: ','.join(self._rivals['methods']),
            'jobs': lambda: str(self._rivals['jobs']),
            'pairs': self._most_pairs, 'missed': self._missed,
            'figure': self._figure, 'shift': self._shift}

    def fill(self, text: str) -> str:
        """
        Return the text with everything filled in.

        :raises InputError: for braces that stand for nothing.
        """
        return fill(text, self._contents)

    def _rooms(self) -> list[str]:
        return [name for name in self._own if name not in REAL]

    def _goals(self, recordings: Iterable[str]) -> str:
        """Return measures beside their goals, what is worse than the least one in bold."""
        rows = [('', *(cell for name in recordings for cell in (name, 'least', 'aim')))]
        for measure in MEASURES:
            cells = [measure.title]
            for name in recordings:
                cells += _cells(measure, name, self._own[name])
            rows.append(tuple(cells))
        nees = [default_of(self._own[name])['consistency']['nees_mean'] for name in recordings]
        bounds = ('-', '-') if set(recordings) == set(REAL) else ('4.5 to 7.5', '5.5 to 6.5')
        rows.append(('mean NEES of the increments, 6 where the covariance is right',
                     *(cell for mean in nees for cell in (_nees(mean, bounds), *bounds))))
        return table(rows)

    def _missed(self) -> str:
        """Return how many of the bounds on the real recordings were missed."""
        least = aim = total = 0
        for measure in MEASURES:
            for name in REAL:
                goal, figures = measure.goal(name), measure.figures(self._own[name])
                total += len(figures)
                least += sum(not measure.reached(*pair) for pair in zip(figures, goal.least))
                aim += sum(not measure.reached(*pair) for pair in zip(figures, goal.aim))
        return (f'Of {total} figures with a bound, {total - least} reach the least that was asked '
                f'for and {total - aim} what was aimed at')

    def _beside_rivals(self, threshold: str, *gaps: str) -> str:
        methods = self._rivals['methods']
        names = list(self._rivals['recordings'])
        rows = [('method', *names, 'failed')]
        for method, scores in methods.items():
            failed = sum(pair['failed'] for name in names
                         for gap, pair in scores[name]['pairs'].items() if gap in gaps)
            rows.append((f'`{method}`', *(
                joined(ratio(scores[name]['pairs'][gap]['success_ratio'][threshold])
                       for gap in gaps) for name in names), str(failed)))
        return table(rows)

    def _variants(self) -> str:
        """Return a table a recording: what each part of the estimator brings."""
        parts = []
        for name, results in self._own.items():
            rows = [(name, '10 mm, gap 1 / 5 / 10', '3.3 mm, gap 1', 'RPE [m]', 'RPE [deg]',
                     'ATE [m]', 'mean NEES', 'inside 95 %')]
            for variant, figures in results['variants'].items():
                path, sure = figures['trajectory'], figures['consistency']
                rows.append((
                    f'`{variant}`', joined(map(ratio, successes(figures))),
                    ratio(successes(figures, '0.0033')[0]),
                    f'{path["rpe_1s_translation_rmse_m"]:.3f}',
                    f'{path["rpe_1s_rotation_rmse_deg"]:.2f}', f'{path["ate_rmse_m"]:.3f}',
                    f'{sure["nees_mean"]:.1f}', ratio(sure['inside_95'])))
            parts.append(table(rows))
        return '\n\n'.join(parts)

    def _skips(self) -> str:
        rows = [('recording', 'one frame of', 'frames', 'RPE over 1 s [m]', 'RPE over 1 s [deg]',
                 'ATE [m]', 'tracked')]
        for name, results in self._own.items():
            every = {'frames': results['frames'], **default_of(results)['trajectory']}
            for skip, figures in {'1': every, **results['skips']}.items():
                rows.append((
                    name, skip, str(figures['frames']),
                    f'{figures["rpe_1s_translation_rmse_m"]:.3f}',
                    f'{figures["rpe_1s_rotation_rmse_deg"]:.2f}', f'{figures["ate_rmse_m"]:.3f}',
                    f'{100 * figures["tracked_fraction"]:.0f} %'))
        return table(rows)

    def _shifts(self) -> str:
        shifts = list(next(iter(self._own.values()))['shifted_truth'])
        shown = [shift for shift in shifts if int(shift) % 10 == 0]
        rows = [('shift of the ground truth [ms]', *shown)]
        for name, results in self._own.items():
            by_shift = results['shifted_truth']
            rows.append((f'{name}, rotation [deg]', *(
                f'{by_shift[shift]["rotation_median_deg"]:.2f}' for shift in shown)))
            rows.append((f'{name}, translation [mm]', *(
                f'{1e3 * by_shift[shift]["translation_median_m"]:.1f}' for shift in shown)))
        return table(rows)

    def _loops(self) -> str:
        rows = [('recording', 'three single steps less one over three',
                 'one over three less the ground truth', 'the ground truth shifted')]
        for name, results in self._own.items():
            loops = results['loops']
            rows.append((name, *(
                f'{1e3 * loops[key]["translation_median_m"]:.1f} mm, '
                f'{loops[key]["rotation_median_deg"]:.2f} deg'
                for key in ('closing', 'truth', 'truth_shifted'))))
        return table(rows)

    def _stamps(self) -> str:
        rows = [('recording', 'interval of the stamps [ms]', 'its deviation [ms]',
                 'increments while turning', 'correlation')]
        for name in REAL:  # rendered ones are stamped when they are taken
            stamps = self._own[name]['stamps']
            rows.append((name, f'{stamps["interval_ms"]:.1f}',
                         f'{stamps["interval_sigma_ms"]:.1f}', str(stamps['turning']),
                         ratio(stamps['correlation'])))
        return table(rows)

    def _settings(self) -> str:
        return table([('method', 'settings'), *(
            (f'`{method}`', text) for method, text in self._rivals['settings'].items())])

    def _histograms(self) -> str:
        return '\n\n'.join(f'![NEES of the increments on {name}]({IMAGES}/nees-{name}.png)'
                           for name in self._own)

    def _most_pairs(self) -> str:
        return str(max(count for facts in self._rivals['recordings'].values()
                       for count in facts['pairs'].values()))

    def _figure(self, recording: str, *keys: str) -> str:
        """Return one figure of the JSON by its path, with three significant digits."""
        value: Any = self._own[recording]
        for key in keys:
            value = value[key]
        return f'{value:.3g}'

    def _shift(self, recording: str) -> str:
        """Return the shift of the ground truth with the least rotation error, and its effect."""
        errors = {shift: figures['rotation_median_deg']
                  for shift, figures in self._own[recording]['shifted_truth'].items()}
        best = min(errors, key=errors.get)
        return (f'{int(best):+d} ms, which takes it from {errors["0"]:.2f} to '
                f'{errors[best]:.2f} deg')


def _cells(measure: Measure, recording: str, results: Mapping[str, Any]) -> tuple[str, ...]:
    figures, goal = measure.figures(results), measure.goal(recording)
    if goal is None:
        return joined(format(figure, measure.form) for figure in figures), '-', '-'
    shown = (format(figure, measure.form) if measure.reached(figure, bound)
             else f'**{figure:{measure.form}}**' for figure, bound in zip(figures, goal.least))
    return (joined(shown), *(joined(format(bound, measure.form) for bound in bounds)
                             for bounds in (goal.least, goal.aim)))


def _nees(mean: float, bounds: tuple[str, str]) -> str:
    low, _, high = bounds[0].partition(' to ')
    is_right = not high or float(low) <= round(mean, 1) <= float(high)
    return f'{mean:.1f}' if is_right else f'**{mean:.1f}**'


def read_results() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the results of the recordings, the real ones first, and those of the rivals."""
    results = {path.stem: json.loads(path.read_text())
               for path in sorted((HERE / 'results').glob('*.json'))}
    rivals = results.pop('rivals')
    return {name: results[name] for name in (*REAL, *results)}, rivals


def page_text() -> str:
    """Return docs/accuracy.md."""
    return Page(*read_results()).fill((HERE / 'page.md').read_text())


def main() -> None:
    """Write the page and the pictures."""
    own, _ = read_results()
    (DOCS / 'accuracy.md').write_text(page_text())
    folder = DOCS / IMAGES
    folder.mkdir(exist_ok=True, parents=True)
    canvas.write_png(growth_figure({name: results['growth'] for name, results in own.items()
                                    if name not in REAL}), folder / 'growth.png')
    for name, results in own.items():
        canvas.write_png(nees_figure(default_of(results)['nees'], f'{name}, defaults'),
                         folder / f'nees-{name}.png')


if __name__ == '__main__':
    main()
