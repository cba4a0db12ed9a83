# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick parameters``: all parameters with their defaults."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.text import config_text, parameter_table

_TITLE = ('Parameters of odom_node, made by "aick parameters --format yaml". Those of the '
          'algorithm are commented out with their defaults, so that a preset can change them; '
          'aick --config reads this file too.')


class Format(str, Enum):
    """Format of the output."""

    MARKDOWN = 'markdown'
    YAML = 'yaml'


Form = Annotated[Format, typer.Option(
    '--format', help='A table, or a parameter file for the node and --config.')]


def parameters(format: Form = Format.MARKDOWN) -> int:
    """List all parameters with default, range and meaning."""
    if format is Format.YAML:
        text = config_text(NodeSettings(), commented=Settings(), title=_TITLE)
    else:
        text = (f'Algorithm (also --set NAME=VALUE):\n\n{parameter_table(Settings())}\n'
                f'Node:\n\n{parameter_table(NodeSettings())}')
    typer.echo(text, nl=False)
    return 0
