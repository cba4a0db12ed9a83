# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs one command line; an error becomes one sentence and an exit code."""

from __future__ import annotations

import errno
import io
import os
import platform
import sys
import tempfile
import traceback
from collections.abc import Sequence
from typing import Any

import typer

import aick_ros
from aick_ros.borders import no_memory
from aick_ros.borders.streams import flush_output
from aick_ros.cli import exit_codes
from aick_ros.cli.app import app
from aick_ros.cli.input.options import DEPTH_IN_COLOUR, SEVEN_NUMBERS
from aick_ros.cli.output.console import say
from aick_ros.cli.packages import missing_package
from aick_ros.errors import InputError

_TRACEBACK = '--traceback'
_USER_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EACCES, errno.EPERM, errno.EROFS,
                errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EISDIR, errno.EIO,
                errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.EBADF)


def run(arguments: Sequence[str]) -> int:
    """
    Run one command line.

    :returns: an exit code of :mod:`aick_ros.cli.exit_codes`.
    """
    _prepare_streams()
    arguments = list(arguments) or ['--help']
    show_traceback = _TRACEBACK in arguments
    command = [_with_home(argument) for argument in arguments if argument != _TRACEBACK]
    try:
        return _invoke(command)
    except InputError as error:
        say(str(error))
        return exit_codes.UNUSABLE_INPUT
    except KeyboardInterrupt:
        say('interrupted')
        return exit_codes.INTERRUPTED_BY_USER
    except BrokenPipeError:
        return exit_codes.PIPE_CLOSED  # the reader of the output has closed it
    except Exception as error:
        sentence = _user_sentence(error)
        if sentence:
            say(sentence)
            return exit_codes.UNUSABLE_INPUT
        _report_defect(error, arguments, show_traceback)
        return exit_codes.DEFECT
    finally:
        flush_output()


def _with_home(argument: str) -> str:
    """Return an option with its value where that begins with ~, which no shell fills in there."""
    option, separator, value = argument.partition('=')
    if not option.startswith('--') or not value.startswith('~'):
        return argument
    return f'{option}{separator}{os.path.expanduser(value)}'


def _prepare_streams() -> None:
    """Make the output streams accept any text, also where they are closed or ASCII."""
    for name in ('stdout', 'stderr'):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, 'w', encoding='utf-8'))
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')


def _invoke(arguments: list[str]) -> int:
    """Run a command without the error handling of typer."""
    command = typer.main.get_command(app)
    try:
        with command.make_context('aick', arguments) as context:
            code = command.invoke(context)
    except typer.Exit as end:
        code = end.exit_code
    sys.stdout.flush()
    return code or exit_codes.DONE


def _user_sentence(error: Exception) -> str:
    """Return the sentence for an error that the user can correct, '' for any other."""
    if isinstance(error, FileNotFoundError) and not _current_folder_exists():
        return 'the current folder has been removed: change to one that exists'
    if isinstance(error, FileNotFoundError) and error.filename:
        return f'{error.filename}: {error.strerror}: was it removed meanwhile?'
    if isinstance(error, OSError) and error.errno in _USER_ERRORS:
        return f'{error.filename or "writing"}: {error.strerror}'
    if no_memory.is_of_memory(error):
        return no_memory.SENTENCE
    if sentence := missing_package(error):
        return sentence
    # typer raises the usage errors of click or, in later versions, of its own copy of click
    if not hasattr(error, 'format_message'):
        return ''
    if DEPTH_IN_COLOUR in _options_of(error):
        return SEVEN_NUMBERS
    context: Any = getattr(error, 'ctx', None)
    where = context.command_path if context is not None else 'aick'
    sentence = error.format_message().rstrip('.')
    return f'{sentence}{" See" if sentence.endswith("?") else "; see"} {where} --help'


def _options_of(error: Exception) -> Sequence[str]:
    """Return the names of the option that a usage error is about; none where it is of none."""
    name, parameter = getattr(error, 'option_name', None), getattr(error, 'param', None)
    return [name] if name is not None else getattr(parameter, 'opts', [])


def _current_folder_exists() -> bool:
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True


def _report_defect(error: Exception, arguments: Sequence[str], show_traceback: bool) -> None:
    what = f'{type(error).__name__}: {error}'
    text = (f'aick {" ".join(arguments)}\naick_ros {aick_ros.__version__}, Python '
            f'{platform.python_version()}, {platform.platform()}\n\n'
            + ''.join(traceback.format_exception(error)))
    if show_traceback:
        print(text, file=sys.stderr)
        say(f'this is a defect of aick ({what}): please report it with the text above')
        return
    try:
        # of an unpredictable name and readable by its owner alone
        with tempfile.NamedTemporaryFile('w', prefix='aick-traceback-', suffix='.txt',
                                         errors='backslashreplace', delete=False) as file:
            file.write(text)
    except OSError:
        print(text, file=sys.stderr)
        say(f'this is a defect of aick ({what}): please report it with the text above')
        return
    say(f'this is a defect of aick ({what}): please report it with the file {file.name}')
