# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pages of documentation whose figures are filled in from what was measured."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from aick_ros.errors import InputError


def fill(text: str, contents: Mapping[str, Callable[..., str]]) -> str:
    """
    Return a text with everything in double braces filled in.

    :param contents: name -> what makes its content. Braces have a name, or the first word of one
        and words which are given to it: ``{{ratio pnp 5}}``.
    :raises InputError: for braces that stand for nothing.
    """
    return re.sub(r'\{\{(.+?)\}\}', lambda match: _content(match[1], contents), text)


def _content(name: str, contents: Mapping[str, Callable[..., str]]) -> str:
    kind, arguments = (name, []) if name in contents else (name.split()[0], name.split()[1:])
    try:
        return contents[kind](*arguments)
    except (KeyError, TypeError):
        raise InputError(f'{{{{{name}}}}} stands for nothing that was measured') from None


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return a table, its head first."""
    lines = [f'| {" | ".join(row)} |' for row in rows]
    return '\n'.join([lines[0], '|' + '---|' * len(rows[0]), *lines[1:]])


def joined(figures: Iterable[str]) -> str:
    """Return figures that belong together, those of several recordings for example."""
    return ' / '.join(figures)


def ratio(value: float | None) -> str:
    """Return two decimals; '-' of none."""
    return '-' if value is None else f'{value:.2f}'


def number(value: float | None) -> str:
    """Return three significant digits; '-' of none."""
    if value is None:
        return '-'
    return f'{value:,.0f}' if value >= 100 else f'{value:.3g}'


def machine(results: Mapping[str, Any]) -> str:
    """Return when and on what something was measured: ``date`` and ``machine`` of a JSON."""
    facts = results['machine']
    return (f'{results["date"]}, {facts["cpu"]}, {facts["cores"]} cores, {facts["system"]}, '
            f'Python {facts["python"]}, NumPy {facts["numpy"]}, OpenCV {facts["opencv"]}, '
            f'aick_ros {facts["aick_ros"]}')
