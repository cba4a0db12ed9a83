# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The subcommands of ``aick``, in the order in which ``aick --help`` lists them."""

from __future__ import annotations

from typing import Annotated

import typer

import aick_ros
from aick_ros.cli.commands.benchmark import benchmark
from aick_ros.cli.commands.compare import compare
from aick_ros.cli.commands.convert import convert
from aick_ros.cli.commands.demo import demo
from aick_ros.cli.commands.evaluate import evaluate
from aick_ros.cli.commands.fleet import fleet
from aick_ros.cli.commands.noise import noise
from aick_ros.cli.commands.parameters import parameters
from aick_ros.cli.commands.replay import replay
from aick_ros.cli.commands.simulate import simulate
from aick_ros.cli.commands.view import view
from aick_ros.cli.commands.vocabulary import vocabulary

COMMANDS = (replay, evaluate, fleet, compare, view, benchmark, simulate, convert, vocabulary,
            noise, parameters, demo)

app = typer.Typer(
    add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
    epilog='Exit codes: 0 done, 1 a defect of aick, 2 unusable input, 3 a regression, '
           '130 interrupted. '
           '--traceback prints the traceback of a defect. "aick COMMAND --help" explains a '
           'command.')
for command in COMMANDS:
    app.command()(command)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f'aick {aick_ros.__version__}')
        raise typer.Exit


Version = Annotated[bool, typer.Option(
    '--version', callback=_show_version, is_eager=True, help='Print the version and exit.')]


@app.callback()
def options(version: Version = False) -> None:
    """RGB-D odometry by Adaptive Iterative Closest Keypoint (AICK), on recordings."""
