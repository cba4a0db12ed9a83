# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dask with settings of its own, with none, and without Dask."""

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
