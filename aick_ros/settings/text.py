# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters as text: a table for people, a YAML file for the node."""

from __future__ import annotations

import functools
import textwrap
from collections.abc import Iterator, Sequence

from aick_ros.settings.parameter import Group, Parameter, Value, parameters

_WIDTH = 99


def parameter_table(group: Group | type[Group]) -> str:
    """
    Return the parameters of a group of settings as a Markdown table.

    :param group: an instance of a settings class, or the class for its defaults.
    """
    rows = [(f'`{p.name}`', f'`{scalar_text(p.default)}`', p.range_text, _description(p))
            for p in parameters(group)]
    head = [('parameter', 'default', 'range', 'description'), ('---',) * 4]
    return ''.join('| ' + ' | '.join(cell.replace('|', '\\|') for cell in row) + ' |\n'
                   for row in [*head, *rows])


def config_text(*groups: Group, commented: Group | None = None,
                title: str = '') -> str:
    """
    Return a ROS parameter file (YAML) with a comment on each parameter: description and range.

    :param groups: instances of settings classes, whose values are written.
    :param commented: a group whose values are commented out, so that they do not override a
        preset.
    :param title: comment at the top of the file.
    """
    lines = [f'# {line}' for line in textwrap.wrap(title, _WIDTH - 2)]
    lines += ['/**:', '  ros__parameters:']
    for group in groups:
        for p in parameters(group):
            # commented out: ROS cannot infer the type of an empty list
            lines += _entry(p, '#' if p.default == () else '')
    if commented is not None:
        for p in parameters(commented):
            lines += _entry(p, '#')
    return '\n'.join(lines) + '\n'


def _entry(p: Parameter, mark: str) -> Iterator[str]:
    yield from _comment(_description(p) + (f' [{p.range_text}]' if p.range_text else ''))
    yield f'    {mark}{p.name}: {scalar_text(p.default)}'


@functools.cache  # a fleet writes the same ones for each of its runs
def _comment(text: str) -> Sequence[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent='    # ', subsequent_indent='    # ',
                         break_on_hyphens=False)


def _description(p: Parameter) -> str:
    return p.description if p.range_text or not p.unit else f'{p.description} [{p.unit}]'


def scalar_text(value: Value) -> str:
    """Return a value as YAML 1.1 text that is parsed back to the same type."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        mantissa, e, exponent = repr(value).partition('e')
        return (mantissa if '.' in mantissa else f'{mantissa}.0') + e + exponent
    if isinstance(value, tuple):
        return '[' + ', '.join(scalar_text(float(item)) for item in value) + ']'
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return str(value)
