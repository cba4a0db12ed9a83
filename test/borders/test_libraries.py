# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables with which OpenCV or NumPy cannot be used are input errors, told before they are."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from aick_ros.borders.libraries import check_libraries

CHECK = """
from aick_ros.borders.libraries import check_libraries
from aick_ros.errors import InputError
try:
    check_libraries()
except InputError as error:
    print(error)
"""


def checked(name, value):
    """Return what is said about a variable, in a process that has not imported the libraries."""
    run = subprocess.run([sys.executable, '-c', CHECK], capture_output=True, text=True,
                         check=True, env={**os.environ, name: value})
    assert run.stderr == ''
    return run.stdout


@pytest.mark.parametrize('name', [
    'OPENCV_CPU_DISABLE', 'OPENCV_FOR_THREADS_NUM', 'OPENCV_IO_MAX_IMAGE_PIXELS',
    'NUMPY_MADVISE_HUGEPAGE'])
def test_what_the_libraries_reject_is_named(name):
    said = checked(name, 'nonsense')
    assert said.startswith(f'OpenCV or NumPy rejects {name}=nonsense (')
    assert said.endswith('): correct the variable, or unset it\n') and said.count('\n') == 1


@pytest.mark.parametrize('value', ['1025', '99999', '9' * 5000])
def test_threads_without_number_are_rejected(value):
    assert checked('OPENCV_FOR_THREADS_NUM', value) == (
        f'OpenCV would start {value} threads (OPENCV_FOR_THREADS_NUM): at most 1024 are '
        'supported; correct the variable, or unset it\n')


@pytest.mark.parametrize('name, value', [
    ('OPENCV_FOR_THREADS_NUM', '1024'), ('OPENCV_FOR_THREADS_NUM', '2'),
    ('OPENCV_LOG_LEVEL', 'DEBUG'), ('OPENCV_LOG_LEVEL', 'x'),
    ('OPENCV_IO_MAX_IMAGE_PIXELS', str(2 ** 20)), ('NPY_DISABLE_CPU_FEATURES', 'AVX512F')])
def test_what_they_take_is_no_error(name, value):
    assert checked(name, value) == ''


def test_without_their_variables_nothing_is_tried(monkeypatch):
    for name in list(os.environ):
        if name.startswith(('OPENCV_', 'NPY_', 'NUMPY_')):
            monkeypatch.delenv(name)
    monkeypatch.setattr(os, 'fork', lambda: pytest.fail('a process is started'))
    check_libraries()


def test_where_the_libraries_are_not_installed_nothing_is_rejected():
    """Python without the installed packages: that they are missing is said elsewhere."""
    run = subprocess.run(
        [sys.executable, '-S', '-c', CHECK], capture_output=True, text=True, check=True,
        env={'PYTHONPATH': str(Path(__file__).parents[2]), 'OPENCV_FOR_THREADS_NUM': 'nonsense'})
    assert (run.stdout, run.stderr) == ('', '')
