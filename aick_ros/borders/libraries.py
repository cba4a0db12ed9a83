# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables of the environment with which OpenCV or NumPy would end the process, or complain."""

from __future__ import annotations

import os
import re
import resource
from importlib import import_module

from aick_ros.borders.threads import ONE_THREAD
from aick_ros.errors import InputError

_THEIRS = ('OPENCV_', 'NPY_', 'NUMPY_')
_THREADS, _MOST_THREADS = 'OPENCV_FOR_THREADS_NUM', 1024
"""Variable for a number of threads, which OpenCV starts, however many; the largest is chosen."""


def check_libraries() -> None:
    """
    Check, before OpenCV and NumPy are imported, that they can be used with their variables.

    For some values they end the process, about others they print lines, so that a child tries.

    :raises InputError: naming the variables, with what the library says.
    """
    names = [name for name, value in os.environ.items()
             if name.startswith(_THEIRS) and ONE_THREAD.get(name) != value]
    if not names:
        return
    threads = os.environ.get(_THREADS, '')
    if re.fullmatch('[0-9]+', threads) and (len(threads) > 9 or int(threads) > _MOST_THREADS):
        raise InputError(f'OpenCV would start {threads} threads ({_THREADS}): at '
                         f'most {_MOST_THREADS} are supported; correct the variable, or unset it')
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        _try(writing)
    os.close(writing)
    with open(reading, errors='backslashreplace') as output:
        said = [line for line in output.read().splitlines() if line.strip()]
    complaints = [line for line in said if any(word in line for word in ('OPENCV: ', *names))]
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) or complaints:
        variables = ', '.join(f'{name}={os.environ[name]}' for name in names)
        raise InputError(f'OpenCV or NumPy rejects {variables} '
                         f'({(complaints or said or ["it ends"])[0].strip()}): correct the '
                         'variable, or unset it')


def _try(output: int) -> None:
    """Use the libraries and end the process, with 0 also where they are not installed."""
    os.dup2(output, 2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if 'OPENCV_LOG_LEVEL' in os.environ:
        os.environ['OPENCV_LOG_LEVEL'] = 'ERROR'  # lines of the others are what was asked for
    code = 1
    try:
        np, cv2 = map(import_module, ('numpy', 'cv2'))
        cv2.getNumThreads()  # some are read at the first use
        cv2.ipp.useIPP()
        image = cv2.GaussianBlur(np.zeros((8, 8), np.uint8), (3, 3), 1.0)
        cv2.imdecode(cv2.imencode('.png', image)[1], cv2.IMREAD_UNCHANGED)
        code = 0
    except ModuleNotFoundError:
        code = 0
    except Exception as error:
        os.write(2, str(error).encode(errors='backslashreplace'))
    finally:
        os._exit(code)
