# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dask with settings of its own, with none, and without Dask."""

import resource
import sys

import dask
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.engine.requirements import check_dask


@pytest.mark.parametrize('missing, named', [('dask', 'dask'), ('distributed', 'distributed')])
def test_without_dask_the_extra_is_named(monkeypatch, missing, named):
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=f"^no tasks without {named}: pip install '.\\[fleet\\]'"):
        check_dask()


def test_folders_and_files_of_settings_are_read(monkeypatch, tmp_path):
    (tmp_path / 'dask.yaml').write_text('temporary-directory: here\n')
    for value in (tmp_path, tmp_path / 'dask.yaml', tmp_path / 'none', ''):
        monkeypatch.setenv('DASK_CONFIG', str(value))
        check_dask()


def test_what_dask_says_of_its_settings_is_passed_on(monkeypatch):
    def collect():
        raise TypeError('unreadable')
    monkeypatch.setattr(dask.config, 'collect', collect)
    with pytest.raises(InputError, match=r'^Dask cannot be used \(unreadable\): correct its'):
        check_dask()


@pytest.mark.parametrize('allowed, is_enough', [
    (999_999_999, False), (10 ** 9, True), (resource.RLIM_INFINITY, True)])
def test_so_little_memory_that_libraries_abort_is_rejected(monkeypatch, allowed, is_enough):
    limits = {resource.RLIMIT_AS: allowed, resource.RLIMIT_DATA: resource.RLIM_INFINITY}
    monkeypatch.setattr(resource, 'getrlimit', lambda kind: (
        limits.get(kind, 64), resource.RLIM_INFINITY))
    if is_enough:
        check_dask()
    else:
        with pytest.raises(InputError, match='limited to 999 MB .*require 1000 MB: raise the li'):
            check_dask()
