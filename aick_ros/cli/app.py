# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The subcommands of ``aick``, in the order in which ``aick --help`` lists them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import aick_ros
from aick_ros.cli.input.interruption import endings
from aick_ros.ros.process.signals import held

COMMANDS = ('replay', 'evaluate', 'fleet', 'compare', 'view', 'benchmark', 'simulate', 'convert',
            'vocabulary', 'noise', 'parameters', 'demo')
"""Names of the commands, of their modules, and of the functions in these."""


class _Imported(Mapping[str, Any]):
    """The commands by name, each imported when it is asked for: most imports are of others."""

    def __getitem__(self, name: str) -> Any:
        if name not in COMMANDS:
            raise KeyError(name)
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command()(_function(name))
        return typer.main.get_command(alone)

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


def _function(name: str) -> Callable[..., int]:
    """Return the function of a command."""
    with held(endings()):  # an interrupted import fails in unexpected ways
        module = import_module(f'aick_ros.cli.commands.{name}')
    function: Callable[..., int] = getattr(module, name)
    return function


class _Commands(TyperGroup):
    """The group of them."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**{**attributes, 'commands': _Imported()})


app = typer.Typer(
    cls=_Commands, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
    epilog='Exit codes: 0 done, 1 a defect of aick, 2 unusable input, 3 a regression, '
           '130 interrupted. '
           '--traceback prints the traceback of a defect. "aick COMMAND --help" explains a '
           'command.')


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f'aick {aick_ros.__version__}')
        raise typer.Exit


Version = Annotated[bool, typer.Option(
    '--version', callback=_show_version, is_eager=True, help='Print the version and exit.')]


@app.callback()
def options(version: Version = False) -> None:
    """RGB-D odometry by Adaptive Iterative Closest Keypoint (AICK), on recordings."""
