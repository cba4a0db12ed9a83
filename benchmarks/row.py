# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A line of a benchmark's table."""

from __future__ import annotations

from dataclasses import dataclass

HEAD = '| measure | must | measured | met | command |\n|---|---|---|---|---|'


@dataclass(frozen=True)
class Row:
    """
    One measured figure.

    :param must: the bound; figures at least or at most as large are good.
    """

    measure: str
    must: float
    at_least: bool
    measured: float
    unit: str
    command: str
    remark: str = ''

    @property
    def met(self) -> bool:
        """Return whether the figure meets its bound."""
        return self.measured >= self.must if self.at_least else self.measured <= self.must

    def __str__(self) -> str:
        """Return the row of a Markdown table."""
        must = f'{">=" if self.at_least else "<="} {self.must:g} {self.unit}'.strip()
        measured = f'{self.measured:.3g} {self.unit}'.strip()
        remark = f', {self.remark}' if self.remark else ''
        return (f'| {self.measure} | {must} | {measured}{remark} | '
                f'{"yes" if self.met else "NO"} | `{self.command}` |')
