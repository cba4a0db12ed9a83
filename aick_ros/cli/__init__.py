# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``aick``: subcommands in commands/, their shared parts in input/ and output/."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from aick_ros.borders import no_memory
from aick_ros.borders.address_space import check_address_space
from aick_ros.borders.allocator import keep_freed_memory
from aick_ros.borders.libraries import check_libraries
from aick_ros.borders.open_files import check_open_files
from aick_ros.borders.streams import open_streams, say
from aick_ros.borders.threads import one_thread_per_call
from aick_ros.borders.variables import remove_unusable
from aick_ros.cli.exit_codes import INTERRUPTED_BY_USER, UNUSABLE_INPUT
from aick_ros.cli.input.interruption import endings, endings_interrupt
from aick_ros.cli.packages import missing_package
from aick_ros.errors import InputError
from aick_ros.ros.process.signals import held

_MEMORY = 550_000_000  # [byte] of addresses; measured: with 420 OpenBLAS ends the process

_OPEN_FILES = 16  # chosen: with 12 all is read and written


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """
    Run the command and exit with a code of :mod:`aick_ros.cli.exit_codes`.

    :param arguments: without the name of the program; None: those of the process.
    """
    try:
        with endings_interrupt(is_last=arguments is None):
            with held(endings()):  # an interrupted import fails in unexpected ways
                open_streams()
                keep_freed_memory()
                _prepare_environment()
                check_address_space(_MEMORY, 'the libraries of this command')
                check_open_files(_OPEN_FILES, 'the libraries of this command')
                check_libraries()
                from aick_ros.cli.run import run
            code = run(sys.argv[1:] if arguments is None else arguments)
    except ModuleNotFoundError as error:
        sentence = missing_package(error)
        if not sentence:
            raise
        say('aick', sentence)
        sys.exit(UNUSABLE_INPUT)
    except (ImportError, MemoryError) as error:
        if not no_memory.is_of_memory(error):
            raise
        say('aick', no_memory.SENTENCE)
        sys.exit(UNUSABLE_INPUT)
    except InputError as error:
        say('aick', str(error))
        sys.exit(UNUSABLE_INPUT)
    except KeyboardInterrupt:
        say('aick', 'interrupted')
        sys.exit(INTERRUPTED_BY_USER)
    sys.exit(code)


def _prepare_environment() -> None:
    """Set variables that libraries read when they are imported."""
    one_thread_per_call()
    # plots go to files; a backend that does not exist would make matplotlib's import fail
    os.environ['MPLBACKEND'] = 'agg'
    os.environ.pop('MATPLOTLIBRC', None)  # the style is ours, and the file may never end
    remove_unusable()
    # of a folder for its cache that cannot be written, without which it only starts later
    logging.getLogger('matplotlib').setLevel(logging.ERROR)
