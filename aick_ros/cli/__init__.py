# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``aick``: subcommands in commands/, their shared parts in input/ and output/."""

from __future__ import annotations

import logging
import os
import re
import sys
from collections.abc import Sequence
from typing import NoReturn

from aick_ros.cli import no_memory
from aick_ros.cli.input.interruption import endings, endings_interrupt
from aick_ros.errors import installation, package_of
from aick_ros.ros.process.signals import held

_NEEDED = ('typer', 'rich', 'yaml')
_OPENCV = ('OPENCV_FOR_THREADS_NUM', 'OPENCV_IO_MAX_IMAGE_PIXELS', 'OPENCV_IO_MAX_IMAGE_WIDTH',
           'OPENCV_IO_MAX_IMAGE_HEIGHT')
"""Numbers that OpenCV reads; it ends the process where one is none."""

_EPOCH = re.compile('[0-9]{1,11}')  # seconds, up to the year 5138


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """
    Run the command and exit: 0 done, 1 a defect of aick, 2 unusable input, 130 interrupted.

    :param arguments: without the name of the program; None: those of the process.
    """
    _prepare_environment()
    try:
        with endings_interrupt(is_last=arguments is None):
            with held(endings()):  # an interrupted import fails in unexpected ways
                from aick_ros.cli.run import run
            code = run(sys.argv[1:] if arguments is None else arguments)
    except ModuleNotFoundError as error:
        package = package_of(error)
        if package not in _NEEDED:
            raise
        print(f"aick: the command needs {package}: {installation('cli')}", file=sys.stderr)
        sys.exit(2)
    except (ImportError, MemoryError) as error:
        if not no_memory.is_of_memory(error):
            raise
        print(f'aick: {no_memory.SENTENCE}', file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print('aick: interrupted', file=sys.stderr)
        sys.exit(130)
    sys.exit(code)


def _prepare_environment() -> None:
    """Set variables that libraries read when they are imported."""
    # The matrices are small: BLAS threads gain little on an idle machine and cost a multiple on a
    # busy one. NumPy reads this variable when it is first imported.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    # plots go to files; a backend that does not exist would make matplotlib's import fail
    os.environ['MPLBACKEND'] = 'agg'
    # matplotlib stamps plots with it, and fails where it is no time
    if not _EPOCH.fullmatch(os.environ.get('SOURCE_DATE_EPOCH', '0')):
        del os.environ['SOURCE_DATE_EPOCH']
    for name in _OPENCV:
        if not _EPOCH.fullmatch(os.environ.get(name, '0')):
            del os.environ[name]
    # of a folder for its cache that cannot be written, without which it only starts later
    logging.getLogger('matplotlib').setLevel(logging.ERROR)
